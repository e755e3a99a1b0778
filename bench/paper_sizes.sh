#!/bin/sh
# Time per step and peak memory of each stage at the paper's sizes, on the built-in data.
# usage: bench/paper_sizes.sh [PROGRAM]     (default build/release/restage)
set -eu
cd "$(dirname "$0")/.."
program=${1:-build/release/restage}
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
data='data.bodies.train=4 data.bodies.validation=2 data.bodies.test=2 data.motions.train=22 data.motions.validation=4 data.motions.test=4'

# measure CONFIG STAGE BATCH STEPS [OVERRIDES]: one line of the log, with the process's peak.
measure() {
  config=$1 stage=$2 batch=$3 steps=$4
  shift 4
  # shellcheck disable=SC2086  # overrides are words
  line=$("$program" train "configs/paper/$config.yaml" $data "stages=[$stage]" "run_root=$runs" "name=bench" \
    "$stage.optimiser.steps=$steps" "$stage.optimiser.batch=$batch" "$@" 2>&1 | grep ' ms a step')
  printf '%s, batch %s: %s\n' "$config" "$batch" "$line"
}

measure point_transformer skeleton 4 3 skeleton.optimiser.schedule.kind=constant 'skeleton.optimiser.schedule.milestones=[]' \
  skeleton.validation_clouds=1
measure v1 skeleton 16 5 skeleton.validation_clouds=1
measure smrm motion 16 5 motion.optimiser.schedule.kind=constant 'motion.optimiser.schedule.milestones=[]' motion.validation_windows=1
measure deformation deformation 16 5 deformation.validation_pairs=1 deformation.skinning_steps=0
