#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# validate_gltf.sh COMMAND PICTURE WORK: designs a small lens and a mirror, exports them as .glb and lets
# Khronos's gltf-validator, a module of Node.js, look at them. Ends with 77 where either is missing: put the module where node finds it,
# for example `npm install --prefix ~/gltf gltf-validator` and NODE_PATH=~/gltf/node_modules.
set -euo pipefail
command=$1 picture=$2 work=$3
node -e "require('gltf-validator')" 2>/dev/null ||
  { echo "skipped: node with the module gltf-validator is not installed"; exit 77; }
mkdir -p "$work"

# validate NAME OPTION...
validate() {
  local name=$1
  "$command" design "$picture" --out "$work/$name" --pixels 16 --rounds 1 --quiet --force "${@:2}" >/dev/null
  "$command" export "$work/$name" --out "$work/$name.glb" --force --quiet >/dev/null
  node -e "
    const validator = require('gltf-validator');
    const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
    validator.validateBytes(bytes, {maxIssues: 100}).then(report => {
      for (const issue of report.issues.messages) {
        console.log(issue.severity, issue.code, issue.pointer, issue.message);
      }
      const {numErrors, numWarnings} = report.issues;
      console.log(process.argv[2] + ': ' + numErrors + ' errors, ' + numWarnings + ' warnings');
      process.exit(numErrors + numWarnings > 0 ? 1 : 0);
    });
  " "$work/$name.glb" "$name"
}

validate lens
validate mirror --mode reflect --incidence 20
validate curved --front sphere:200
