#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bundle.sh BUILD OUT: packs the command of a build folder with all its libraries but glibc's into
# OUT/lensforge-VERSION-MACHINE-linux.tar.zst: a folder that runs from any place on a Linux whose glibc is at least
# that of the machine which packs it. Needs patchelf, zstd and strip.
set -euo pipefail
[[ $# -eq 2 ]] || { sed -n '3,5s/^# //p' "$0" >&2; exit 2; }
BUILD=$1 OUT=$2
# shellcheck source=.cmake/libraries.sh
. "$(dirname "${BASH_SOURCE[0]}")/libraries.sh"
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$BUILD/CMakeCache.txt")
name=lensforge-$version-$(uname -m)-linux
folder=$OUT/$name
modules=$folder/lib/lensforge
rm -rf "$folder" "$folder.tar.zst"
mkdir -p "$OUT"
cmake --install "$BUILD" --component command --prefix "$folder" >/dev/null

gather_libraries "$modules" "$folder/share/doc/lensforge/licences" "$folder/bin/lensforge" "$modules"/lensforge-*.so
# shellcheck disable=SC2016
for module in "$modules"/lensforge-*.so; do place_program "$module" '$ORIGIN'; done
# shellcheck disable=SC2016
place_program "$folder/bin/lensforge" '$ORIGIN/../lib/lensforge'
tar -C "$OUT" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@${SOURCE_DATE_EPOCH:-0}" -c "$name" |
  zstd -q -19 -T0 -o "$folder.tar.zst"
du -k "$modules"/* | sort -rn | awk -v all=0 '{all += $1; if (NR <= 5) printf "%6.1f MB  %s\n", $1 / 1024, $2}
  END {printf "%6.1f MB  all %d libraries and modules\n", all / 1024, NR}' >&2
ls "$folder.tar.zst"
