#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# page_test.sh COMMAND WORK: lets a browser lead a picture through the page of a studio. Ends with 77 where node, npm
# or the browser is missing, or npm cannot fetch what drives it.
set -euo pipefail
command=$1 work=$2
readonly DRIVER=puppeteer-core@24.43.1 RULES=axe-core@4.14.1
browser=${CHROMIUM:-/usr/bin/chromium}
for program in node npm "$browser"; do
  command -v "$program" >/dev/null || { echo "skipped: $program is not installed"; exit 77; }
done
rm -rf "$work/studio" "$work/shots"
mkdir -p "$work/shots"
[[ -d $work/node_modules/axe-core && -d $work/node_modules/puppeteer-core ]] ||
  npm install --silent --no-audit --no-fund --prefix "$work" "$DRIVER" "$RULES" ||
  { echo "skipped: npm cannot fetch $DRIVER and $RULES"; exit 77; }
cp "$(dirname "${BASH_SOURCE[0]}")/page_test.mjs" "$work/"

"$command" studio "$work/studio" --port 0 2>"$work/studio.log" &
studio=$!
trap 'kill $studio 2>/dev/null; wait $studio || true' EXIT
for _ in {1..50}; do
  address=$(grep -o 'http://[^ ]*' "$work/studio.log" || true)
  [[ -z $address ]] || break
  sleep 0.2
done
CHROMIUM=$browser node "$work/page_test.mjs" "$address" "$work/shots"
