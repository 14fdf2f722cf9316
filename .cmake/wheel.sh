#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# wheel.sh BUILD OUT: packs the Python module of a build folder with all its libraries but glibc's into a wheel in OUT,
# for the Python that it was built for and for a glibc that is at least this machine's. Needs patchelf and strip.
set -euo pipefail
[[ $# -eq 2 ]] || { sed -n '3,4s/^# //p' "$0" >&2; exit 2; }
BUILD=$1 OUT=$2
here=$(dirname "${BASH_SOURCE[0]}")
# shellcheck source=.cmake/libraries.sh
. "$here/libraries.sh"
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$BUILD/CMakeCache.txt")
python=$(PATH=/usr/bin:$PATH command -v python3)
folder=$OUT/wheel
rm -rf "$folder" && mkdir -p "$folder/lensforge/lib"
cp "$BUILD"/python/lensforge/{*.py,__init__.pyi,py.typed,_lensforge*.so} "$folder/lensforge"
cp "$BUILD"/lensforge-*.so "$folder/lensforge/lib"

modules=("$folder"/lensforge/lib/lensforge-*.so)
extension=$(echo "$folder"/lensforge/_lensforge*.so)
gather_libraries "$folder/lensforge/lib" "$folder/lensforge/licences" "$extension" "${modules[@]}"
# shellcheck disable=SC2016
for module in "${modules[@]}"; do place_program "$module" '$ORIGIN'; done
# shellcheck disable=SC2016
place_program "$extension" '$ORIGIN/lib'
"$python" "$here/lensforge_wheel.py" "$folder" "$version" "$OUT"
rm -rf "$folder"
