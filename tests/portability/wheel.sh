#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# wheel.sh WHEEL.whl PICTURES RELEASE [FOLDER]: installs what ./bootstrap wheel made with pip into a fresh virtual
# environment in a bare root of the Debian release that it was made on (bookworm, trixie), where numpy is Debian's,
# and runs README's lines on a picture of PICTURES. The root is kept in FOLDER (build/portability/bare).
set -euo pipefail
[[ $# -ge 3 && $# -le 4 && $3 =~ ^(bookworm|trixie)$ ]] || { sed -n '3,5s/^# //p' "$0" >&2; exit 2; }
WHEEL=$(realpath "$1") PICTURES=$(realpath "$2") RELEASE=$3
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/portability/root.sh
. tests/portability/root.sh
ROOT=$(realpath -m "${4:-build/portability/bare}")/$RELEASE

make_root "$RELEASE" "$ROOT"
rm -rf "$ROOT/wheel" && mkdir -p "$ROOT/wheel"
cp "$WHEEL" "$PICTURES/portrait.png" "$ROOT/wheel"
# The lines of Python in README.
sed -n '/^```python$/,/^```$/p' README.md | grep -v '^```' >"$ROOT/wheel/readme.py"
in_root "$ROOT" '
  export DEBIAN_FRONTEND=noninteractive
  dpkg-query -W python3-venv python3-numpy >/dev/null 2>&1 ||
    { apt-get -q update; apt-get -q install -y --no-install-recommends python3-venv python3-numpy; } >/dev/null
  cd /wheel
  python3 -m venv --system-site-packages environment
  environment/bin/pip -q install --no-index ./*.whl
  environment/bin/python readme.py
  environment/bin/pip show lensforge'
