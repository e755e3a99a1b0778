#!/usr/bin/env bash
# What a machine with a GPU is asked first: whether all tests of the GPU pass there, and how long the papers'
# schedules would take, from measured steps of each stage in each precision of products.
#
#   cmake --preset release -B build/cuda -DRESTAGE_CUDA=ON && ninja -C build/cuda
#   bench/on_gpu.sh build/cuda OUT
set -euo pipefail
[ $# = 2 ] || { sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
build=$(readlink -m "$1") out=$(readlink -m "$2")
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
mkdir -p "$out"

nvidia-smi --query-gpu=name,memory.total,driver_version --format=csv | tee "$out/gpu.csv"
code=0
"$build/tests/restage_tests" --gtest_filter='DeviceGpu.*' 2>&1 | tee "$out/tests.txt" || code=$?
for precision in float32 tf32; do
  echo "== the papers' schedule, products in $precision"
  "$build/restage" train configs/paper/all.yaml device=cuda precision=$precision --dry-run --json \
    > "$out/forecast-$precision.json" 2> "$out/forecast-$precision.txt" || code=$?
  cat "$out/forecast-$precision.txt"
done
exit "$code"
