#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# debian.sh RELEASE COMPILER [FOLDER]: builds the committed sources in a bare root of a Debian release (bookworm,
# trixie) with gcc or with the newest clang of that release, runs the fast tests there, makes a wheel, and prints the
# versions of the compiler and the libraries used. The root is kept in FOLDER (build/portability) for the next run.
set -euo pipefail
[[ $# -ge 2 && $# -le 3 && $1 =~ ^(bookworm|trixie)$ && $2 =~ ^(gcc|clang)$ ]] ||
  { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
RELEASE=$1 COMPILER=$2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/portability/root.sh
. tests/portability/root.sh
ROOT=$(realpath -m "${3:-build/portability}")/$RELEASE
SOURCES=/lensforge-$COMPILER

make_root "$RELEASE" "$ROOT"
# A clone leaves files alone that did not change, and so their build outputs.
[[ -d $ROOT$SOURCES/.git ]] || git clone -q . "$ROOT$SOURCES"
git -C "$ROOT$SOURCES" fetch -q origin HEAD
git -C "$ROOT$SOURCES" reset -q --hard FETCH_HEAD

compiler() {
  [[ $COMPILER == clang ]] || { echo 'export CC=gcc CXX=g++'; return; }
  # shellcheck disable=SC2016
  echo '
    export DEBIAN_FRONTEND=noninteractive
    apt-get -q update
    newest=$(apt-cache pkgnames clang- | grep -x "clang-[0-9]*" | sort -t- -k2n | tail -1)
    apt-get -q install -y --no-install-recommends "$newest"
    export CC=$newest CXX=${newest/clang/clang++}'
}

outcome=0
in_root "$ROOT" "$(compiler)
  cd $SOURCES && ./bootstrap test && ./bootstrap wheel" || outcome=$?
# shellcheck disable=SC2016
in_root "$ROOT" "$(compiler) >/dev/null"'
  echo "release: $(cat /etc/debian_version); compiler: $($CXX --version | head -1)"
  for package in libembree-dev libocct-foundation-dev libcgal-dev libopenimageio-dev libopenmesh-dev libfftw3-dev \
      libtbb-dev libcpp-httplib-dev libtomlplusplus-dev libeigen3-dev libmodbus-dev librsvg2-dev cmake; do
    dpkg-query -W -f="\${Package} \${Version}\n" "$package"
  done'
exit "$outcome"
