#!/usr/bin/env bash
# What a machine with a GPU is asked: whether all tests of the GPU pass there, how long a step of every stage takes
# in each precision of products, and so the papers' schedules. Takes about two minutes. With a folder of the open benchmark
# also the steps of the other systems on bodies of 6,890 vertices; with CHECK=1 what NVIDIA's checkers of memory, races
# and barriers say of the tests, which takes much longer.
#
#   cmake --preset release -B build/cuda -DRESTAGE_CUDA=ON && ninja -C build/cuda
#   bench/on_gpu.sh build/cuda OUT [BENCHMARK]
set -euo pipefail
[ $# = 2 ] || [ $# = 3 ] || { sed -n '2,9s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
build=$(readlink -m "$1") out=$(readlink -m "$2") benchmark=${3:+$(readlink -m "$3")}
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
mkdir -p "$out"
code=0

# forecast NAME CONFIG ARGS...: measured steps, as text and JSON.
forecast() {
  local name=$1
  shift
  echo "== $name"
  "$build/restage" train "$@" device=cuda --dry-run --json > "$out/forecast-$name.json" 2> "$out/forecast-$name.txt" || code=$?
  cat "$out/forecast-$name.txt" "$out/forecast-$name.json"
}

nvidia-smi --query-gpu=name,memory.total,driver_version --format=csv | tee "$out/gpu.csv"
"$build/tests/restage_tests" --gtest_filter='DeviceGpu.*' 2>&1 | tee "$out/tests.txt" || code=$?
for precision in float32 tf32; do
  forecast "paper-$precision" configs/paper/all.yaml precision=$precision loop.validate_every=1000000
  [ -n "$benchmark" ] || continue
  for system in npt lart corenet; do
    forecast "$system-$precision" configs/$system/paper.yaml "data.source=$benchmark" precision=$precision transfer.validation_pairs=1
  done
done
if [ -n "${CHECK:-}" ]; then
  for tool in memcheck racecheck synccheck; do
    compute-sanitizer --tool $tool --error-exitcode 1 "$build/tests/restage_tests" --gtest_filter='DeviceGpu.*' \
      2>&1 | tee "$out/$tool.txt" || code=$?
  done
fi
exit "$code"
