#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# same_bytes.sh BEFORE AFTER PICTURES [DESIGN OPTIONS...]: shows that two builds of the command compute the same.
# Designs every picture of the folder PICTURES at 64 x 64 in every surface model and kind of light, renders,
# exports and cuts some of the lenses, and compares all files, results, messages and exit codes byte for byte, but
# for the seconds that a step took. PICTURES: the nine that lensforge_pictures draws (build/release/pictures).
# Without DESIGN OPTIONS the designs are short: --quality draft --rounds 1. Exit code 1 on any difference; both
# outputs are kept then.
set -euo pipefail
[[ $# -ge 3 ]] || { sed -n '3,8s/^# //p' "$0" >&2; exit 2; }
BEFORE=$(realpath "$1") AFTER=$(realpath "$2") PICTURES=$(realpath "$3")
export PICTURES
shift 3
export DESIGN="--pixels 64 --width 12mm --focal 40mm ${*:---quality draft --rounds 1}"
WORK=$(mktemp -d "${TMPDIR:-/tmp}/same_bytes.XXXX")
export WORK
cd "$WORK"

# Kinds of light: a name, then options of design.
lights() {
  cat <<'LIGHTS'
parallel
point --source point --source-position 6,6,-80
lambertian --source point --source-position 4,7,-60 --emission lambertian
sun --source-angle 2
lamp --source point --source-position 6,6,-200 --source-size 0.5
front --front sphere:60
hollow --front sphere:-80 --source point --source-position 6,6,-90
fresnel --fresnel
colours --wavelengths 470,550,630
tilted --screen-tilt 15,10 --image-width 16 --image-offset 2,1
outline --outline circle
mirror --mode reflect --incidence 20
mirror-point --mode reflect --source point --source-position -20,6,60
made-by --made-by default
mould --part mould --shrinkage 0.005
rear --view rear
LIGHTS
}

# run FOLDER NAME ARGUMENTS...: runs the command in FOLDER; keeps output, messages and exit code under NAME.
run() {
  local folder=$1 name=$2 outcome=0
  shift 2
  (cd "$folder" && ./lensforge "$@" --threads 1 --quiet >"$name.out" 2>"$name.err") || outcome=$?
  echo "$outcome" >"$folder/$name.code"
}
export -f run

# design_both PICTURE MODEL LIGHT OPTIONS...: one lens by both programs.
design_both() {
  local picture=$1 model=$2 light=$3 side lens
  shift 3
  lens=$picture-$model-$light
  for side in before after; do
    # shellcheck disable=SC2086  # DESIGN is a list of options.
    run "$side" "$lens" design "$PICTURES/$picture.png" --out "$lens" --model "$model" $DESIGN "$@"
  done
}
export -f design_both

# follow_both LENS: what comes after a design, by both programs.
follow_both() {
  local lens=$1 side format
  for side in before after; do
    run "$side" "$lens.render" render "$lens" --out "$lens.again" --json
    run "$side" "$lens.cam" cam "$lens"
    run "$side" "$lens.info" info "$lens"
    for format in step iges stl obj ply 3mf glb exr; do
      run "$side" "$lens.$format" export "$lens" --out "exports/$lens.$format"
    done
  done
}
export -f follow_both

# whole_program FOLDER: what the command says of itself, and what it makes without a picture.
whole_program() {
  local verb
  run "$1" help --help
  while read -r verb; do
    run "$1" "help-$verb" "$verb" --help
  done < <(sed -n 's/^  lensforge \([a-z]*\) .*/\1/p' "$1/help.out")
  for verb in bash zsh fish; do run "$1" "completions-$verb" completions "$verb"; done
  run "$1" coupon coupon --out coupon
}

# several FOLDER: what takes more than one lens.
several() {
  run "$1" nest nest portrait-spline-parallel lake-spline-parallel --blank 60,40 --out nest
  run "$1" view view portrait-spline-parallel --out view.html
}

# Seconds that a step took and dates differ from run to run.
without_times() {
  find "$1" -name '*.csv' -exec sed -i 's/,[^,]*$//' {} +
  find "$1" -type f \( -name '*.json' -o -name '*.out' -o -name '*.err' -o -name '*.html' \) -exec \
    sed -i -E 's/("(seconds|[a-z_]*_seconds|date|written)": )[^,}]*/\1-/g; s/[0-9.]+ s$/- s/; s/(Made in )[0-9.]+/\1-/;
      s/^( *seconds +).*/\1-/' {} +
  find "$1" -type f \( -name '*.step' -o -name '*.iges' \) -exec \
    sed -i -E "s/[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}/-/; s/[0-9]{8}\.[0-9]{6}/-/g" {} +
}

mkdir before after
ln -s "$BEFORE" before/lensforge
ln -s "$AFTER" after/lensforge
whole_program before
whole_program after
pictures=$(cd "$PICTURES" && printf '%s\n' *.png | sed 's|\.png$||')
for picture in $pictures; do
  for model in spline smooth facet; do lights | sed "s/^/$picture $model /"; done
done >designs
# shellcheck disable=SC2016  # The shells that xargs starts expand these.
xargs -P "$(nproc)" -I CASE bash -c 'design_both $1' design CASE <designs
# Every picture in parallel light and one picture in every light, as splines; one lens of each other model.
{
  for picture in $pictures; do echo "$picture-spline-parallel"; done
  lights | sed 's/ .*//; s/^/portrait-spline-/'
  echo portrait-smooth-parallel
  echo portrait-facet-parallel
} | sort -u >followed
# shellcheck disable=SC2016
xargs -P "$(nproc)" -I LENS bash -c 'follow_both "$1"' follow LENS <followed
several before
several after
without_times before
without_times after
rm before/lensforge after/lensforge
files=$(find before -type f | wc -l)
designed=$(grep -lx 0 before/*.code | wc -l)
if diff -rq before after; then
  echo "same bytes: $files files of $(wc -l <designs) designs, $designed runs of which succeeded"
  rm -rf "$WORK"
else
  echo "different bytes: see $WORK" >&2
  exit 1
fi
