#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bundle.sh BUILD OUT: packs the command of a build folder with all its libraries but glibc's into
# OUT/lensforge-VERSION-MACHINE-linux.tar.zst: a folder that runs from any place on a Linux whose glibc is at least
# that of the machine which packs it. Needs patchelf, zstd and strip.
set -euo pipefail
[[ $# -eq 2 ]] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
BUILD=$1 OUT=$2
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$BUILD/CMakeCache.txt")
name=lensforge-$version-$(uname -m)-linux
folder=$OUT/$name
rm -rf "$folder" "$folder.tar.zst"
mkdir -p "$OUT"
cmake --install "$BUILD" --component command --prefix "$folder" >/dev/null
libraries=$folder/lib/lensforge
# Debian's folder for libraries names the machine; a bundle is for one.
[[ -d $libraries ]] || { mv "$folder/lib/"*/lensforge "$libraries" && rmdir "$folder/lib/"*-linux-gnu; }

# glibc and what the kernel and the graphics driver bring must be the machine's own.
is_of_system() { [[ $1 =~ ^(ld-linux.*|linux-vdso|libc|libm|libdl|librt|libpthread|libresolv|libutil|libnss_.*|libanl)\.so ]]; }

# All libraries that the files need, each once, as "soname path".
needed() { ldd "$@" 2>/dev/null | awk '$2 == "=>" && $3 ~ /^\// {print $1, $3}' | sort -u; }

declare -A packages=()
while read -r soname path; do
  if is_of_system "$soname"; then continue; fi
  cp --dereference "$path" "$libraries/$soname"
  package=$(dpkg-query -S "$(realpath "$path")" 2>/dev/null | head -1 | cut -d: -f1 || true)
  [[ -z $package ]] || packages[$package]=1
done < <(needed "$folder/bin/lensforge" "$libraries"/lensforge-*.so)

chmod u+w "$libraries"/* && strip --strip-unneeded "$libraries"/*.so* "$folder/bin/lensforge"
for library in "$libraries"/*.so*; do patchelf --set-rpath '$ORIGIN' "$library"; done
patchelf --set-rpath '$ORIGIN/../lib/lensforge' "$folder/bin/lensforge"

# The licence of everything inside.
mkdir -p "$folder/share/doc/lensforge/licences"
for package in "${!packages[@]}"; do
  cp --dereference "/usr/share/doc/$package/copyright" "$folder/share/doc/lensforge/licences/$package"
done
tar -C "$OUT" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@${SOURCE_DATE_EPOCH:-0}" -c "$name" |
  zstd -q -19 -T0 -o "$folder.tar.zst"
du -k "$libraries"/* | sort -rn | head -5 | awk '{printf "%6.1f MB  %s\n", $1 / 1024, $2}' >&2
ls "$folder.tar.zst"
