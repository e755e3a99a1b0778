#!/bin/sh
# Lets others judge what the writers wrote: Khronos' validator reads the GLB files and Chromium opens
# the page. usage: check_outputs.sh TEST_PROGRAM (build/release/tests/restage_tests)
# Each check that lacks its program (node, gltf-validator, chromium) is skipped and says so.
set -eu
here=$(dirname "$0")
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
RESTAGE_KEEP=$out "$1" --gtest_brief=1 --gtest_filter='GlbWriterTest.*:Page.IsOneFile*'
command -v node > /dev/null || { echo "skipped: node is not installed"; exit 0; }
run() { "$@" || { code=$?; [ "$code" = 77 ] || exit "$code"; }; }
run node "$here/validate_glb.mjs" "$out"/*.glb
run node "$here/page_screenshot.mjs" "$out/page.html"
