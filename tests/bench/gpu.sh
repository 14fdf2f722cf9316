#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Everything about the GPU path in one go: builds, checks, times, prints one table. Under 8 minutes.
#
#   gpu.sh [run]      on a machine with a GPU. Builds first if the packages for that are installed,
#                     otherwise runs the programs that gpu.sh pack has made.
#   gpu.sh pack       builds on any machine with nvcc, and puts the programs with their libraries
#                     into build/gpu/pack, to be copied to a machine that only has a GPU.
#
# ARCHITECTURES lists the GPUs to build for (default 90, an H100); logs go to OUT (build/gpu/out).
# Never changes a setting of the GPU. Exit code 0 only if everything ran and passed.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1

readonly BUILD=build/gpu/build
readonly PACK=build/gpu/pack
readonly OUT=${OUT:-build/gpu/out}
readonly TARGETS=(executor_tests gpu_bench)
failures=()

say() { printf 'gpu.sh: %s\n' "$*"; }
fail() { failures+=("$*"); say "FAILED: $*"; }

# Runs a check under a time limit, with its output in a log. usage: check NAME SECONDS COMMAND...
check() {
  local name=$1 limit=$2 begin=$SECONDS
  shift 2
  if timeout "$limit" "$@" >"$OUT/$name.log" 2>&1; then
    say "$name: passed, $((SECONDS - begin)) s"
  else
    fail "$name (exit code $?, $((SECONDS - begin)) s); the end of $OUT/$name.log:"
    tail -n 25 "$OUT/$name.log"
  fi
}

# The first of some programs that is there. usage: first_of NAME PATH...
first_of() {
  local path
  command -v "$1" && return
  for path in "${@:2}"; do
    [[ ! -x $path ]] || { printf '%s\n' "$path"; return; }
  done
}

# --- building ------------------------------------------------------------------------------------

build() {
  mkdir -p "$BUILD"
  cmake -S . -B "$BUILD" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CUDA_ARCHITECTURES="${ARCHITECTURES:-90}" >"$BUILD/configure.log" 2>&1 &&
    grep -q '^-- GPU: CUDA' "$BUILD/configure.log" &&
    ninja -C "$BUILD" "${TARGETS[@]}" >"$BUILD/build.log" 2>&1
}

# The programs with every library that they need, except those that each machine has: the compiler's,
# the C library's and CUDA's.
pack() {
  build || { say "cannot build; see $BUILD/configure.log and $BUILD/build.log"; exit 1; }
  rm -rf "$PACK"
  mkdir -p "$PACK/lib"
  cp "$BUILD/tests/executor_tests" "$BUILD/gpu/gpu_bench" "$PACK/"
  ldd "$PACK/executor_tests" "$PACK/gpu_bench" | awk '/=> \// { print $3 }' | sort -u |
    grep -vE '/(libc|libm|libdl|librt|libpthread|libstdc\+\+|libgcc_s|libcufft)\.so' | xargs -I LIB cp -L LIB "$PACK/lib/"
  say "packed $(du -sh "$PACK" | cut -f1) into $PACK"
}

find_programs() {
  if build; then
    tests=$BUILD/tests/executor_tests
    bench=$BUILD/gpu/gpu_bench
    say "built"
  elif [[ -x $PACK/executor_tests ]]; then
    tests=$PACK/executor_tests
    bench=$PACK/gpu_bench
    export LD_LIBRARY_PATH=$PWD/$PACK/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    say "cannot build here; taking the packed programs"
  else
    say "cannot build here (see $BUILD), and nothing was packed (gpu.sh pack)"
    exit 1
  fi
}

# cuFFT may be in CUDA's folder or in a Python package.
find_cufft() {
  ! ldd "$tests" | grep 'libcufft' | grep -q 'not found' && return
  local place
  for place in /usr/local/cuda*/lib64 /usr/local/cuda*/targets/*/lib \
    $(python3 -c 'import site; print(*site.getsitepackages())' 2>/dev/null); do
    place=$(find -L "$place" -name 'libcufft.so.12' -print -quit 2>/dev/null)
    [[ -n $place ]] || continue
    place=$(dirname "$place")
    export LD_LIBRARY_PATH=$place${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    return
  done
  say "libcufft.so.12 is nowhere to be found"
  exit 1
}

# --- checking ------------------------------------------------------------------------------------

# Parity with the CPU, on a real GPU: a skipped test counts as failed.
check_parity() {
  check parity 120 "$tests" --gtest_filter='Cuda*:EmulatedGpu*'
  ! grep -q 'SKIPPED' "$OUT/parity.log" || fail "parity: tests were skipped"
}

check_memory() {
  local sanitizer tool
  sanitizer=$(first_of compute-sanitizer /usr/local/cuda*/bin/compute-sanitizer)
  if [[ -z $sanitizer ]]; then
    fail "compute-sanitizer is not installed; memory was not checked"
    return
  fi
  for tool in memcheck racecheck synccheck initcheck; do
    check "$tool" 30 "$sanitizer" --tool "$tool" --error-exitcode 9 "$tests" \
      --gtest_filter='Cuda/*.EvaluationsHave*:Cuda/*.Precond*:Cuda/*.Flux*:Cuda/*.Cotangent*'
  done
}

# --- timing --------------------------------------------------------------------------------------

# Reads the counters of every kernel where ncu can: memory traffic, double precision.
profile() {
  local ncu
  ncu=$(first_of ncu /usr/local/cuda*/bin/ncu /opt/nvidia/nsight-compute/*/ncu)
  if [[ -z $ncu ]]; then
    say "ncu is not installed; no counters"
    return
  fi
  local metrics=gpu__time_duration.sum,dram__bytes.sum
  metrics+=,dram__throughput.avg.pct_of_peak_sustained_elapsed
  metrics+=,sm__inst_executed_pipe_fp64.avg.pct_of_peak_sustained_active
  timeout 60 "$ncu" --clock-control none --csv --metrics "$metrics" --launch-skip 150 \
    --launch-count 300 "$bench" --kernels >"$OUT/counters.csv" 2>"$OUT/counters.log" ||
    say "ncu could not read the counters; see $OUT/counters.log"
}

run() {
  local tests bench
  mkdir -p "$OUT"
  command -v nvidia-smi >/dev/null && nvidia-smi --query-gpu=name,driver_version --format=csv,noheader
  find_programs
  find_cufft
  check_parity
  check bench 180 "$bench"
  profile
  check_memory
  printf '\n'
  cat "$OUT/bench.log"
  if [[ -s $OUT/counters.csv ]] && command -v python3 >/dev/null; then
    python3 tests/bench/gpu_counters.py "$OUT/counters.csv"
  fi
  printf '\n'
  if [[ ${#failures[@]} -gt 0 ]]; then
    printf 'FAILED: %s\n' "${failures[@]}"
    exit 1
  fi
  say "all passed, $SECONDS s"
}

case ${1:-run} in
  run) run ;;
  pack) pack ;;
  *) say "usage: gpu.sh [run|pack]"; exit 2 ;;
esac
