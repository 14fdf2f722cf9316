#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bundle.sh BUNDLE.tar.zst PICTURES RELEASE [FOLDER]: unpacks what ./bootstrap bundle made in a bare root of a Debian
# release (bookworm, trixie) and takes a picture of PICTURES (build/release/pictures) from there to G-code, STEP and a
# page, and an SVG drawing and a STEP file back to pictures. The root is kept in FOLDER (build/portability/bare).
set -euo pipefail
[[ $# -ge 3 && $# -le 4 && $3 =~ ^(bookworm|trixie)$ ]] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
BUNDLE=$(realpath "$1") PICTURES=$(realpath "$2") RELEASE=$3
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/portability/root.sh
. tests/portability/root.sh
ROOT=$(realpath -m "${4:-build/portability/bare}")/$RELEASE

make_root "$RELEASE" "$ROOT"
rm -rf "$ROOT/opt/lensforge" "$ROOT/work"
mkdir -p "$ROOT/opt/lensforge" "$ROOT/work"
tar -x --zstd -f "$BUNDLE" -C "$ROOT/opt/lensforge" --strip-components=1
cp "$PICTURES/portrait.png" "$ROOT/work"
cat >"$ROOT/work/drawing.svg" <<'SVG'
<svg xmlns="http://www.w3.org/2000/svg" width="40" height="30"><circle cx="20" cy="15" r="9" fill="white"/></svg>
SVG
in_root "$ROOT" '
  cd /work
  lensforge() { echo "lensforge $*"; /opt/lensforge/bin/lensforge "$@" --quiet; }
  /opt/lensforge/bin/lensforge --version
  lensforge design portrait.png --pixels 64 --width 25 --focal 75 --quality draft --out lens
  lensforge cam lens --post grbl --pitch 0.1 --slope-tolerance 2e-4 --no-remedies || [[ $? -eq 3 ]]
  lensforge export lens --out lens.step
  lensforge render lens.step --focal 75 --pixels 64 --out again.png
  lensforge view lens --out lens.html
  lensforge info drawing.svg
  lensforge send lens/cam/finish.ngc --port sim:grbl --dry-run || [[ $? -eq 3 ]]
  ls -l lens/overview.png lens/cam/finish.ngc lens/cam/report.html lens.step lens.html again.png'
