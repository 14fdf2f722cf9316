#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# draw_gallery.sh BUILD: designs a lens, a mirror and a reflecting shape from the drawn fixtures and
# puts their pictures and what the program says of them into docs/gallery.md. ./bootstrap gallery.
set -euo pipefail
readonly BUILD=$1
readonly OUT=$BUILD/gallery
readonly PAGE=docs/gallery.md

# piece NAME TITLE PICTURE CAPTION COMMAND...: one design, as a section of the page. Exit code 3 says
# that a limit was missed, as the text that is put into the page does.
piece() {
  local name=$1 title=$2 picture=$3 caption=$4 outcome=0
  shift 4
  printf 'gallery: %s\n' "$title" >&2
  "$BUILD/lensforge" "$@" --out "$OUT/$name" --force --quiet >"$OUT/$name.txt" || outcome=$?
  [[ $outcome -eq 0 || $outcome -eq 3 ]] || exit "$outcome"
  cp "$OUT/$name/$picture" "docs/gallery/$name.png"
  {
    printf '\n## %s\n\n%s\n\n![%s](gallery/%s.png)\n\n' "$title" "$caption" "$title" "$name"
    printf '    lensforge %s --out %s\n\n' "${*//$BUILD\//}" "$name"
    sed "s|$OUT/||g; s|$BUILD/||g; s/,* \(in \)*[0-9.]* s$//; s|^|    |" "$OUT/$name.txt"
  } >>"$OUT/page.md"
}

mkdir -p "$OUT" docs/gallery
"$BUILD/lensforge_fixtures" --shapes "$BUILD/shapes"
cat >"$OUT/page.md" <<'TEXT'
# Gallery

Drawn by `./bootstrap gallery` from pictures and shapes that the project draws. Lens and mirror, from left: the
picture that is wanted; what the surface as designed projects, sharper than the picture; what the part as cut and
polished projects, by the design's own account; the surface as relief.
TEXT
piece lens 'Lens' overview.png 'Parallel light, a wall at 48 mm.' \
  design "$BUILD/pictures/portrait.png" --width 16mm --focal 48mm --pixels 80 --made-by default
piece mirror 'Mirror' overview.png 'Parallel light from 20° to the side, a wall at 48 mm.' \
  design "$BUILD/pictures/lake.png" --width 16mm --focal 48mm --pixels 80 --made-by default \
  --mode reflect --incidence 20
piece reflector 'Reflecting shape' views.png \
  'It is to send little light back to the lamp. What an eye beside the lamp sees from eight directions: above of the
shape as it came, below of the new one.' \
  reflect "$BUILD/shapes/animal.ply" --faces 3000 --anchor 0.03
mv "$OUT/page.md" "$PAGE"
printf 'gallery: %s\n' "$PAGE" >&2
