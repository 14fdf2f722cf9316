# shellcheck shell=bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Sourced: copies of the shared libraries that programs need. Needs patchelf and strip.

# gather_libraries FOLDER LICENCES FILE...: puts all libraries that the files need, but glibc's, into FOLDER, where
# they find each other, and the licences of their Debian packages into LICENCES.
gather_libraries() {
  local folder=$1 licences=$2 soname path package
  shift 2
  mkdir -p "$folder" "$licences"
  while read -r soname path; do
    # glibc must be the machine's own.
    [[ ! $soname =~ ^(ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|anl|nss_.*))\.so ]] || continue
    [[ ! $path -ef $folder/$soname ]] || continue
    cp --dereference "$path" "$folder/$soname"
    chmod u+w "$folder/$soname"
    strip --strip-unneeded "$folder/$soname"
    # shellcheck disable=SC2016
    patchelf --set-rpath '$ORIGIN' "$folder/$soname"
    package=$(dpkg-query -S "$(realpath "$path")" 2>/dev/null | head -1 | cut -d: -f1 || true)
    [[ -z $package ]] || cp --dereference "/usr/share/doc/$package/copyright" "$licences/$package"
  done < <(ldd "$@" 2>/dev/null | awk '$2 == "=>" && $3 ~ /^\// {print $1, $3}' | sort -u)
}

# place_program FILE RPATH: strips a program or module, which then looks for its libraries in RPATH.
place_program() {
  chmod u+w "$1"
  strip --strip-unneeded "$1"
  patchelf --set-rpath "$2" "$1"
}
