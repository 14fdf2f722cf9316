#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# batch_on_engines.sh ENGINE COMMAND PICTURE: does a small batch by `batch` alone, then as three shards under
# ENGINE, GNU parallel (parallel) or a Slurm of its own on this machine (slurm, by srun and as an array), and
# compares folders, files and tables. Ends with 77 where ENGINE is not installed.
set -euo pipefail
readonly ENGINE=$1 COMMAND=$2 PICTURE=$3
readonly SHARDS=3
PATH=$PATH:/usr/sbin
unset "${!SLURM@}" # A Slurm that this runs under is not the one that is tested.

missing() { echo "skipped: $1 is not installed; Debian: apt-get install $2"; exit 77; }
fail() { echo "$ENGINE: $*" >&2; exit 1; }

case $ENGINE in
  parallel) parallel --version 2>/dev/null | grep -q '^GNU parallel' || missing "GNU parallel" parallel ;;
  slurm)
    for program in munged slurmctld slurmd srun sbatch; do
      command -v "$program" >/dev/null || missing "Slurm's $program" "slurm-wlm munge"
    done
    ;;
  *) fail "is no engine; parallel or slurm" ;;
esac

WORK=$(mktemp -d)
readonly WORK
daemons=()

# Jobs of Slurm first, then its daemons, last one first, and what they have left behind.
stop_all() {
  if [[ -v SLURM_CONF ]]; then
    scancel --quiet --user="$(id -un)" 2>/dev/null || true
    wait_until 10 no_jobs || true
    for ((i = ${#daemons[@]} - 1; i >= 0; --i)); do
      kill "${daemons[i]}" 2>/dev/null || true
      wait "${daemons[i]}" 2>/dev/null || true
    done
    for pid in $(of_this_slurm); do kill -KILL "$pid" 2>/dev/null || true; done
  fi
  rm -rf "$WORK"
}
trap stop_all EXIT
trap 'exit 130' INT TERM

# wait_until SECONDS COMMAND...
wait_until() {
  local end=$((SECONDS + $1))
  until "${@:2}" >/dev/null 2>&1; do
    ((SECONDS < end)) || return 1
    sleep 0.2
  done
}

# --- the batch -----------------------------------------------------------------------------------

# job NAME OPTIONS THEN
job() {
  printf '{"name":"%s","command":"design","target":"%s","options":{"pixels":24,"width":25,"rounds":1,%s},"then":[%s]}\n' \
    "$1" "$PICTURE" "$2" "$3"
}

# jobs FOCAL: five jobs; at a focal length of 5 mm the last cannot be done.
jobs() {
  job plain '"quality":"draft"' ''
  job solid '"quality":"draft"' '{"command":"export","options":{"out":"lens.stl"}}'
  job cut '"quality":"draft"' \
    '{"command":"cam","options":{"pitch":"0.5mm","tool-diameter":"2mm","no-rough":true,"no-semi":true}}'
  job facets '"quality":"draft","model":"facet"' '"render"'
  job bad '"quality":"draft","focal":'"$1" ''
}

# What a job has made, by name and content; times are in none of these files.
content_of() {
  (cd "$1/runs" && find . -type f | sort && find . \( -name '*.ply' -o -name '*.stl' -o -name '*.ngc' \) |
    sort | xargs sha256sum)
}

# The table without its columns of seconds.
table_of() {
  python3 -c '
import csv, sys
rows = list(csv.DictReader(open(sys.argv[1], newline="")))
for row in rows:
    print({key: value for key, value in row.items() if not key.endswith("seconds")})
' "$1/table.csv"
}

# collect FOLDER CODE: a last batch finds nothing to do but failed jobs, ends with CODE and writes the table.
collect() {
  local code=0
  (cd "$1" && "$COMMAND" batch "$WORK/jobs" --out runs --table table.csv >collect.log 2>&1) || code=$?
  [[ $code == "$2" ]] || { cat "$1/collect.log"; fail "the last batch ended with $code, not $2"; }
}

# expect_once FOLDER STATUS NAME...: the shards' logs tell of each job once, with this status.
expect_once() {
  local name
  for name in "${@:3}"; do
    [[ $(sed -nE "s,^lensforge: [0-9]+/[0-9]+ $name: (.*),\\1,p" "$1"/shard*.log) == "$2"* ]] ||
      { cat "$1"/shard*.log; fail "$name: not once $2"; }
  done
}

times_of() { stat -c '%n %i %y' "$1"/runs/{plain,solid,cut,facets}/job.json; }

# --- engines: `under_NAME` does the batch in the current folder as shards, and fails if one fails ----

under_parallel() {
  parallel --will-cite --quote -j 2 "$COMMAND" batch "$WORK/jobs" --out runs --threads 1 \
    --shard "{}/$SHARDS" ::: $(seq $SHARDS) >shards.log 2>&1
}

under_srun() {
  # shellcheck disable=SC2016 # The shell that srun starts expands it.
  srun --ntasks=$SHARDS --kill-on-bad-exit=0 --output=shard%t.log bash -c \
    '"$1" batch "$2" --out runs --threads 1 --shard $((SLURM_PROCID + 1))/$SLURM_NTASKS' \
    shard "$COMMAND" "$WORK/jobs"
}

under_array() {
  cat >array.sh <<ARRAY
#!/bin/sh
#SBATCH --array=1-$SHARDS --cpus-per-task=1 --output=shard%a.log
"$COMMAND" batch "$WORK/jobs" --out runs --threads \$SLURM_CPUS_PER_TASK \\
  --shard \$SLURM_ARRAY_TASK_ID/\$SLURM_ARRAY_TASK_COUNT
ARRAY
  local id
  id=$(sbatch --parsable array.sh) || return
  wait_until 300 no_jobs || return
  [[ $(scontrol --oneliner show job "$id" | grep -c 'JobState=COMPLETED') == "$SHARDS" ]]
}

check_under() {
  local folder=$WORK/$1 code=0
  mkdir "$folder"
  jobs 5 >"$WORK/jobs"
  (cd "$folder" && "under_$1") >"$folder/engine.log" 2>&1 || code=$?
  [[ $code != 0 ]] || fail "$1 does not tell that a job failed"
  expect_once "$folder" "done" plain solid cut facets
  expect_once "$folder" "failed, design: --focal 5" bad
  collect "$folder" 1
  diff <(table_of "$WORK/alone") <(table_of "$folder") || fail "$1: another table"
  local before
  before=$(times_of "$folder")
  jobs 300 >"$WORK/jobs"
  rm "$folder"/shard*
  (cd "$folder" && "under_$1") >"$folder/engine.log" 2>&1 || { cat "$folder"/*.log; fail "$1: failed"; }
  expect_once "$folder" "was done before" plain solid cut facets
  expect_once "$folder" "done" bad
  [[ $(times_of "$folder") == "$before" ]] || fail "$1: a job was done twice"
  collect "$folder" 0
  diff <(table_of "$WORK/mended") <(table_of "$folder") || fail "$1: another table of mended jobs"
  diff <(content_of "$WORK/mended") <(content_of "$folder") || fail "$1: other files"
  echo "$1: same folders, files and tables as by batch alone; the failed job was repeated, the others were not"
}

# --- a Slurm of one node, on loopback -----------------------------------------------------------------

no_jobs() { [[ -z $(squeue --noheader) ]]; }
node_is_idle() { [[ $(sinfo --noheader --format=%T) == idle ]]; }
is_free() { ! (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; }

# Processes that were started with this Slurm's configuration; this shell is not among them.
of_this_slurm() {
  local configuration=$SLURM_CONF
  (unset SLURM_CONF && grep -lsz "^SLURM_CONF=$configuration\$" /proc/[0-9]*/environ | cut -d / -f 3)
}

# start NAME COMMAND...: in a session of its own, so that Ctrl-C does not end it before its jobs.
start() {
  setsid "${@:2}" >"$WORK/slurm/$1.out" 2>&1 &
  daemons+=($!)
}

start_slurm() {
  local folder=$WORK/slurm port host user
  host=$(hostname -s) user=$(id -un)
  port=$((20000 + RANDOM / 4))
  until is_free "$port" && is_free "$((port + 1))"; do port=$((port + 2)); done
  # munged demands that everybody can reach its socket.
  mkdir "$folder" && chmod 711 "$WORK" "$folder"
  (umask 077 && head -c 128 /dev/urandom >"$folder/key")
  cat >"$folder/slurm.conf" <<CONF
ClusterName=lensforge
SlurmctldHost=$host(127.0.0.1)
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmctldPort=$port
SlurmdPort=$((port + 1))
AuthType=auth/munge
AuthInfo=socket=$folder/munge
CredType=cred/munge
SlurmUser=$user
SlurmdUser=$user
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName=$host NodeAddr=127.0.0.1 CPUs=$SHARDS
PartitionName=all Nodes=$host Default=YES MaxTime=10
CONF
  export SLURM_CONF=$folder/slurm.conf
  start munged munged --foreground --force --socket="$folder/munge" --key-file="$folder/key" \
    --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" --seed-file="$folder/seed"
  wait_until 10 test -S "$folder/munge" || { cat "$folder/munged".*; fail "munged does not start"; }
  start slurmctld slurmctld -D
  start slurmd slurmd -D
  wait_until 30 node_is_idle || { cat "$folder"/slurm*.{out,log}; fail "Slurm does not start"; }
}

# --- the comparison ------------------------------------------------------------------------------

mkdir "$WORK/alone"
jobs 5 >"$WORK/jobs"
collect "$WORK/alone" 1
cp -r "$WORK/alone" "$WORK/mended"
jobs 300 >"$WORK/jobs"
collect "$WORK/mended" 0
case $ENGINE in
  parallel) check_under parallel ;;
  slurm)
    start_slurm
    check_under srun
    check_under array
    ;;
esac
