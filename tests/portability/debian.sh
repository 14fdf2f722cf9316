#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# debian.sh RELEASE COMPILER [FOLDER]: builds the committed sources in a bare root of a Debian release (bookworm,
# trixie) with gcc or with the newest clang of that release, runs the fast tests there, and prints the versions of
# the compiler and the libraries used. The root is kept in FOLDER (build/portability) for the next run. Needs
# mmdebstrap, and root for chroot. MIRROR names another Debian mirror.
set -euo pipefail
[[ $# -ge 2 && $# -le 3 && $1 =~ ^(bookworm|trixie)$ && $2 =~ ^(gcc|clang)$ ]] ||
  { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
RELEASE=$1 COMPILER=$2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
FOLDER=$(realpath -m "${3:-build/portability}")
ROOT=$FOLDER/$RELEASE
SOURCES=/lensforge-$COMPILER

if [[ ! -e $ROOT/etc/debian_version ]]; then
  mkdir -p "$FOLDER"
  mmdebstrap --variant=minbase --include=ca-certificates "$RELEASE" "$ROOT" "${MIRROR:-http://deb.debian.org/debian}" >&2
fi
# Build outputs stay, so that a second run after a small change is quick.
mkdir -p "$ROOT$SOURCES"
git archive HEAD | tar -x -C "$ROOT$SOURCES"

# Runs in mounts of its own, which end with it.
in_root() {
  # shellcheck disable=SC2016  # The inner shell expands it.
  unshare -m bash -c '
    mount --rbind /dev "$0/dev" && mount -t proc proc "$0/proc" && mount -t tmpfs tmp "$0/tmp"
    exec chroot "$0" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 bash -ec "$1"' "$ROOT" "$1"
}

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
in_root "$(compiler)
  cd $SOURCES && ./bootstrap test" || outcome=$?
in_root "$(compiler)"'
  echo "release: $(cat /etc/debian_version); compiler: $($CXX --version | head -1)"
  for package in libembree-dev libocct-foundation-dev libcgal-dev libopenimageio-dev libopenmesh-dev libfftw3-dev \
      libtbb-dev libcpp-httplib-dev libtomlplusplus-dev libeigen3-dev libmodbus-dev librsvg2-dev cmake; do
    dpkg-query -W -f="${Package} ${Version}\n" "$package"
  done' | tail -14
exit "$outcome"
