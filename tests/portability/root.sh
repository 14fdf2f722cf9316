# shellcheck shell=bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Sourced: bare roots of Debian releases. Needs mmdebstrap, and root for chroot. MIRROR names another Debian mirror.

# make_root RELEASE ROOT: a root with nothing but apt; an existing one is taken as it is.
make_root() {
  [[ ! -e $2/etc/debian_version ]] || return 0
  mkdir -p "$(dirname "$2")"
  mmdebstrap --variant=minbase --include=ca-certificates "$1" "$2" "${MIRROR:-http://deb.debian.org/debian}" >&2
  # No package brings it: an installer writes it.
  [[ -e $2/etc/hosts ]] || printf '127.0.0.1 localhost\n::1 localhost\n' >"$2/etc/hosts"
}

# in_root ROOT SCRIPT: runs a script of bash there, in an empty environment and in mounts that end with it.
in_root() {
  # shellcheck disable=SC2016  # The inner shell expands it.
  unshare -m bash -c '
    mount --rbind /dev "$0/dev" && mount -t proc proc "$0/proc" && mount -t tmpfs tmp "$0/tmp"
    exec chroot "$0" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 bash -ec "$1"' "$1" "$2"
}
