#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# same_bytes.sh PICTURE.png [FOLDER]: compares, byte for byte, what the commands that debian.sh built with gcc in its
# roots in FOLDER (build/portability) make of a picture on Debian 12 and on Debian 13: lenses of every model and several
# kinds of light, programs, reports, solids, meshes, pages. Left out are seconds, dates, and how PNG and 3MF files are
# packed and what their libraries tell of themselves. Exit code 1 if anything else differs; the files are kept then, in
# FOLDER/RELEASE/compared. Needs python3-pil.
set -euo pipefail
[[ $# -ge 1 && $# -le 2 ]] || { sed -n '3,7s/^# //p' "$0" >&2; exit 2; }
PICTURE=$(realpath "$1") ROOTS=$(realpath "${2:-build/portability}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/portability/root.sh
. tests/portability/root.sh

for release in bookworm trixie; do
  made=$ROOTS/$release/compared
  rm -rf "$made" && mkdir -p "$made"
  cp "$PICTURE" "$made/picture.png"
  # shellcheck disable=SC2016  # The shell in the root expands it.
  in_root "$ROOTS/$release" '
    cd /compared
    lensforge() { /lensforge-gcc/build/release/lensforge "$@" --quiet; }
    design() {
      lensforge design picture.png --pixels 64 --width 12mm --focal 40mm --quality draft --rounds 1 --out "$@"
    }
    for model in facet smooth spline; do design "$model" --model "$model"; done
    design point --source point --source-position 6,6,-80
    design lamp --source-angle 2
    design mirror --mode reflect --incidence 20
    design colours --wavelengths 470,550,630
    design round --outline circle --front sphere:60
    design made --made-by default
    for lens in spline facet made round; do
      lensforge cam "$lens" --margin 6mm --no-remedies || [[ $? -eq 3 ]]
    done
    for format in step iges stl obj ply 3mf glb exr; do lensforge export spline --out "spline.$format"; done
    lensforge export smooth --out smooth.step || [[ $? -eq 3 ]]
    lensforge coupon --out coupon
    lensforge view spline --out spline.html' >"$made/said.txt"
  find "$made" -name '*.csv' -exec sed -i 's/,[^,]*$//' {} +
  find "$made" -type f \( -name '*.json' -o -name '*.html' -o -name '*.step' -o -name '*.iges' -o -name '*.txt' \) -exec \
    sed -i -E '
    s/("([a-z_]*seconds|date|written)": )[^,}]*/\1-/; s/[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}/-/
    s/[0-9]{8}\.[0-9]{6},/-,/g; s/(Made in )[0-9.]+/\1-/; s/, [0-9.]+ s$/, - s/' {} +
done
/usr/bin/python3 - "$ROOTS" <<'PYTHON'
import base64, io, pathlib, re, sys, zipfile

import PIL.Image


def pixels(png):
    with PIL.Image.open(io.BytesIO(png)) as picture:
        return f"{picture.mode} {picture.size} ".encode() + picture.tobytes()


def plain(path):
    data = path.read_bytes()
    if path.suffix == ".png":
        return pixels(data)
    if path.suffix == ".3mf":
        with zipfile.ZipFile(path) as archive:
            return b"".join(name.encode() + archive.read(name) for name in sorted(archive.namelist()))
    if path.suffix == ".html":
        return re.sub(rb"(data:image/png;base64,)([A-Za-z0-9+/=]+)",
                      lambda match: match[1] + pixels(base64.b64decode(match[2])), data)
    return data


before, after = (pathlib.Path(sys.argv[1]) / release / "compared" for release in ("bookworm", "trixie"))
names = [{path.relative_to(folder) for path in folder.rglob("*") if path.is_file()} for folder in (before, after)]
differing = sorted(str(name) for name in names[0] ^ names[1])
differing += sorted(str(name) for name in names[0] & names[1] if plain(before / name) != plain(after / name))
print(f"{len(names[0])} files, {len(differing)} differ: {' '.join(differing)}")
sys.exit(1 if differing else 0)
PYTHON
