#!/bin/sh
# Lets others judge what the writers wrote: Khronos' validator reads the GLB files, Blender opens them, Chromium opens the
# pages. usage: check_outputs.sh TEST_PROGRAM (build/release/tests/restage_tests)
# Each check that lacks its program (blender, node, gltf-validator, chromium) says so and is skipped; where RESTAGE_CI is set, it
# fails.
set -eu
here=$(dirname "$0")
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
RESTAGE_KEEP=$out "$1" --gtest_brief=1 --gtest_filter='GlbWriterTest.*:RigConventions.*:Page.IsOneFile*:Report.*'
lacking() { [ -z "${RESTAGE_CI:-}" ] || { echo "lacking, and required in CI: $1" >&2; exit 1; }; }
if command -v blender > /dev/null; then
  blender -b --factory-startup --python "$here/blender_open.py" -- "$out" > "$out/blender.log" 2>&1 ||
    { cat "$out/blender.log"; echo 'Blender shows other bones' >&2; exit 1; }
  grep 'in Blender' "$out/blender.log"
else
  echo 'skipped: blender is not installed'; lacking blender
fi
command -v node > /dev/null || { echo "skipped: node is not installed"; lacking node; exit 0; }
run() { "$@" || { code=$?; [ "$code" = 77 ] || exit "$code"; lacking "what $2 looks for"; }; }
run node "$here/validate_glb.mjs" "$out"/*.glb
run node "$here/page_screenshot.mjs" "$out/page.html"
run node "$here/report_browser.mjs" "$out/report.html"
