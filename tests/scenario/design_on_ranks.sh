#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# design_on_ranks.sh MPIRUN COMMAND PICTURE: designs in one process and on two, three and four ranks, and compares
# the lenses bit by bit; kills a rank, stops rank 0 by a signal, takes memory from a rank, resumes on other numbers
# of ranks; asks for what is refused under mpirun.
set -euo pipefail
readonly MPIRUN=$1 COMMAND=$2 PICTURE=$3
readonly ROUNDS=3
# Open MPI: as root, more ranks than cores, which then give way to each other.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
export OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_hwloc_base_binding_policy=none

WORK=$(mktemp -d)
readonly WORK
job=
clean_up() {
  if [[ -n $job ]]; then kill -KILL "$job" 2>/dev/null || true; fi
  rm -rf "$WORK"
}
trap clean_up EXIT
trap 'exit 130' INT TERM
cd "$WORK"

fail() { echo "design on ranks: $*" >&2; exit 1; }

# wait_until SECONDS COMMAND...
wait_until() {
  local end=$((SECONDS + $1))
  until "${@:2}" >/dev/null 2>&1; do
    ((SECONDS < end)) || return 1
    sleep 0.05
  done
}

# design RANKS OUT OPTIONS...: 0 ranks for a process without mpirun.
design() {
  local start=()
  if (($1 > 0)); then start=("$MPIRUN" -n "$1"); fi
  "${start[@]}" "$COMMAND" design "$PICTURE" --out "$2" --pixels 64 --model $MODEL --rounds $ROUNDS \
    --transport-rounds 2 --threads 1 "${@:3}"
}

# expect_same OUT: as what one process makes, file by file.
expect_same() {
  local file
  for file in surface.ply render.exr render.png target.exr; do
    cmp "$1/$file" "one-$MODEL/$file" || fail "$1/$file is not what one process writes"
  done
}

# start RANKS OUT OPTIONS...: in the background, until it has come so far that there is a round to keep.
start() {
  design "$@" >"$2.out" 2>"$2.err" &
  job=$!
  wait_until 60 test -s "$2/checkpoint.bin" || fail "no checkpoint: $(cat "$2.err")"
  cp "$2/checkpoint.bin" "$2.first"
  wait_until 60 checkpoint_after "$2" || fail "no second checkpoint: $(cat "$2.err")"
}
checkpoint_after() { [[ -s $1/checkpoint.bin ]] && ! cmp -s "$1/checkpoint.bin" "$1.first"; }

# process_of RANK: that of the job in the background.
process_of() {
  local pid
  for pid in $(pgrep -f "^$COMMAND design"); do
    if tr '\0' '\n' <"/proc/$pid/environ" 2>/dev/null | grep -qx "OMPI_COMM_WORLD_RANK=$1" &&
      tr '\0' '\n' <"/proc/$pid/environ" | grep -qx "PWD=$WORK"; then
      echo "$pid"
      return
    fi
  done
  fail "no process of rank $1"
}
none_left() {
  local pid
  for pid in $(pgrep -f "^$COMMAND design"); do
    if tr '\0' '\n' <"/proc/$pid/environ" 2>/dev/null | grep -qx "PWD=$WORK"; then return 1; fi
  done
}

# expect_end SECONDS: the exit code of the job in the background, which no process outlives.
expect_end() {
  wait_until "$1" none_left || fail "ranks still run after $1 s"
  code=0
  wait "$job" || code=$?
  job=
}

same_lenses() {
  local ranks
  design 0 "one-$MODEL" --quiet
  for ranks in 2 3 4; do
    design $ranks "$ranks-$MODEL" --quiet >/dev/null
    grep -q "\"device\": \"$ranks processes\"" "$ranks-$MODEL/lens.json" || fail "not on $ranks ranks"
    expect_same "$ranks-$MODEL"
  done
}

killed_rank() {
  start 3 killed
  kill -KILL "$(process_of 2)"
  expect_end 10
  ((code != 0)) || fail "a run without its rank 2 ends with 0"
  [[ -s killed/checkpoint.bin ]] || fail "no checkpoint of a killed run"
  # mpirun asks rank 0 to stop; where it is not waiting for the dead rank, it leaves its best lens.
  ! grep -qs '"status": "done"' killed/lens.json || fail "a killed run calls its lens done"
  design 2 killed --resume --quiet >/dev/null
  expect_same killed
}

gone() { [[ ! -e /proc/$1 ]]; }

stopped_first_rank() {
  start 2 stopped
  local first begin
  first=$(process_of 0)
  begin=$(date +%s%N)
  kill -TERM "$first"
  wait_until 5 gone "$first" || fail "rank 0 still runs 5 s after SIGTERM"
  echo "rank 0 ended within $((($(date +%s%N) - begin) / 1000000)) ms"
  expect_end 10
  ((code == 130)) || fail "exit code $code after SIGTERM, not 130: $(cat stopped.err)"
  [[ -s stopped/checkpoint.bin ]] || fail "no checkpoint after SIGTERM"
  design 0 stopped --resume --quiet >/dev/null
  expect_same stopped
}

# A rank that fails ends the run with one line: from its second round on it may not take any more memory.
short_of_memory() {
  start 3 short --quiet
  prlimit --as=1048576 --pid "$(process_of 1)"
  expect_end 20
  ((code == 1)) || fail "exit code $code of a rank without memory, not 1: $(cat short.err)"
  [[ $(grep -c '^lensforge: ' short.err) == 1 ]] || fail "not one line: $(cat short.err)"
  grep -q '^lensforge: rank 1: not enough memory$' short.err || fail "$(grep '^lensforge:' short.err)"
}

# refused WORDS -- COMMAND...: exit code 2 and one line with these words.
refused() {
  local words=$1
  shift
  code=0
  "$MPIRUN" -n 2 "$COMMAND" "$@" >refused.out 2>refused.err || code=$?
  ((code == 2)) || fail "$*: exit code $code, not 2"
  [[ $(grep -c '^lensforge: ' refused.err) == 1 ]] || fail "$*: not one line: $(cat refused.err)"
  grep -q "^lensforge: .*$words" refused.err || fail "$*: $(grep '^lensforge:' refused.err)"
}

for MODEL in facet smooth; do same_lenses; done
killed_rank
stopped_first_rank
short_of_memory
refused 'only design shares its work out' render one-smooth
refused '--model spline' design "$PICTURE" --out spline --model spline
refused 'give --model smooth or facet' design "$PICTURE" --out default
refused '--made-by' design "$PICTURE" --out made --made-by default
refused '--device cuda' design "$PICTURE" --out gpu --device cuda
refused 'no-such-picture' design no-such-picture.png --out none
