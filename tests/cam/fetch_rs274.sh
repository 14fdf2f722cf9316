#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# fetch_rs274.sh DEST
#
# Puts LinuxCNC's stand-alone G-code interpreter (rs274, Debian package linuxcnc-uspace) into DEST
# without installing anything: the package and those shared libraries that this system lacks are
# downloaded and unpacked there. Prints the path of a launcher, DEST/rs274. Needs apt-get with
# package lists, dpkg-deb and ldd, no rights. A second call only looks whether the launcher works.
set -euo pipefail

[[ $# == 1 ]] || { echo "usage: fetch_rs274.sh DEST" >&2; exit 2; }
mkdir -p "$1"
dest=$(cd "$1" && pwd)
launcher=$dest/rs274
root=$dest/root

works() {
  local scratch rc=0
  scratch=$(mktemp -d)
  printf 'T1 P1 Z0 D0.4\n' >"$scratch/tool.tbl"
  printf 'G21 G0 X1\nM2\n' >"$scratch/job.ngc"
  : >"$scratch/scratch.var"
  HOME=$scratch "$launcher" -t "$scratch/tool.tbl" -v "$scratch/scratch.var" -g \
    "$scratch/job.ngc" "$scratch/out.canon" >/dev/null 2>&1 || rc=$?
  grep -q STRAIGHT_TRAVERSE "$scratch/out.canon" 2>/dev/null || rc=1
  rm -rf "$scratch"
  return "$rc"
}

unpack() {
  local package
  for package in "$@"; do
    (cd "$dest/download" && apt-get -q -o APT::Sandbox::User=root download "$package" >&2)
  done
  for package in "$dest"/download/*.deb; do
    dpkg-deb -x "$package" "$root"
    rm "$package"
  done
}

library_path() {
  local machine
  machine=$(uname -m)-linux-gnu
  echo "$root/usr/lib:$root/usr/lib/$machine:$root/lib/$machine"
}

missing_libraries() {
  LD_LIBRARY_PATH=$(library_path) ldd "$root/usr/bin/rs274" |
    sed -n 's/^[[:space:]]*\(.*\) => not found/\1/p'
}

# The packages that hold a shared library.
package_of() {
  case $1 in
    libboost_python3*.so.*) echo "libboost-python${1##*.so.}" ;;
    libpython3.*.so.*) echo "${1%.so.*}" "${1%.so.*}-stdlib" "${1%.so.*}-minimal" ;;
    libedit.so.2) echo libedit2 ;;
    libbsd.so.0) echo libbsd0 ;;
    libmd.so.0) echo libmd0 ;;
    libexpat.so.1) echo libexpat1 ;;
    libtinfo.so.6) echo libtinfo6 ;;
    libz.so.1) echo zlib1g ;;
    libstdc++.so.6) echo libstdc++6 ;;
    *) echo "rs274 needs $1, of which no package is known here" >&2; return 1 ;;
  esac
}

fetch() {
  local library packages
  rm -rf "${dest:?}/download"
  mkdir -p "$dest/download" "$root"
  unpack linuxcnc-uspace
  # A library that was fetched may itself need one more.
  for _ in 1 2 3 4; do
    packages=""
    for library in $(missing_libraries); do packages+=" $(package_of "$library")"; done
    [[ -n $packages ]] || break
    # shellcheck disable=SC2086
    unpack $packages
  done
  rmdir "$dest/download"
  # Only what the interpreter needs stays.
  rm -rf "${root:?}/usr/share" "${root:?}/etc" "${root:?}/lib/modules"
}

write_launcher() {
  cat >"$launcher" <<'END'
#!/bin/sh
here=$(dirname "$(readlink -f "$0")")/root
machine=$(uname -m)-linux-gnu
export LD_LIBRARY_PATH="$here/usr/lib:$here/usr/lib/$machine:$here/lib/$machine"
# Only where the Python library had to be fetched as well.
for encodings in "$here"/usr/lib/python3.*/encodings; do
  [ ! -d "$encodings" ] || export PYTHONHOME="$here/usr"
done
exec "$here/usr/bin/rs274" "$@"
END
  chmod +x "$launcher"
}

if [[ ! -x $launcher ]] || ! works; then
  fetch
  write_launcher
  works || { echo "rs274 was fetched into $dest but does not run" >&2; exit 1; }
fi
echo "$launcher"
