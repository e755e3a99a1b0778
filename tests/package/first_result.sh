#!/bin/sh
# first_result.sh PROGRAM SAMPLE: what is typed first in a bare system: is all well; a small training; a body that does what
# the clouds of its test do; a character that does what the scans of SAMPLE (docs/sample) do, and its picture.
set -eu
restage=$1 sample=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$restage" doctor --self
"$restage" train h4d/smoke --quiet
"$restage" eval run="$(echo runs/*)" --out walk > eval.md
"$restage" retarget --source walk/source.h5 --target walk/target.ply --out walk.glb
"$restage" retarget --source "$sample/scans" --fps 6 --target "$sample/hero.glb" --out hero_moving.glb
"$restage" view hero_moving.glb --compare "$sample/scans" --source-fps 6 --columns 5 --out moving.png
test -s walk.glb && test -s hero_moving.glb && test -s moving.png
"$restage" reproduce rekik2024 --table 10 --budget lite --no-run --out page > /dev/null && test -s page/rekik2024.md
