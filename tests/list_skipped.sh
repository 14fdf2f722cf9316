#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# list_skipped.sh FOLDER [--without-gpu]
#
# Prints the tests that were skipped, one a line with the reason, from the XML files that GoogleTest
# left in FOLDER; with --without-gpu only those that do not wait for a GPU or for its absence.
set -euo pipefail

[[ $# -ge 1 ]] || { echo "usage: list_skipped.sh FOLDER [--without-gpu]" >&2; exit 2; }
pattern='$^'
[[ ${2:-} != --without-gpu ]] || pattern=': .*GPU'

# An attribute's value lies between quotes; entities stand for what it must not hold.
find "$1" -name '*.xml' -exec awk '
  function attribute(name) {
    if (!match($0, " " name "=\"[^\"]*\"")) return ""
    return substr($0, RSTART + length(name) + 3, RLENGTH - length(name) - 4)
  }
  /<testcase / { test = attribute("classname") "." attribute("name") }
  /<skipped / {
    reason = attribute("message")
    sub(/^[^&]*&#x0A;/, "", reason)  # The source file and its line.
    sub(/&#x0A;$/, "", reason)
    gsub(/&#x0A;/, " ", reason)
    gsub(/&quot;/, "\"", reason)
    gsub(/&apos;/, "\047", reason)
    gsub(/&lt;/, "<", reason)
    gsub(/&gt;/, ">", reason)
    gsub(/&amp;/, "\\&", reason)
    print test ": " reason
  }' {} + | sort | { grep -v "$pattern" || true; }
