#!/usr/bin/env bash
# debian.sh OUT [PLACE]: the packages that a clean Debian 12 builds, in the folder PLACE of it, from the source package in OUT
# (restage_*.dsc); as root. They come to OUT. Exit code 77: a clean system cannot be made here.
set -euo pipefail
out=$(readlink -f "$1") place=${2:-/build}
# shellcheck source=cmake/package/bare.sh
. "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/bare.sh"
root=$out/root

make_bare bookworm "$root"
mkdir -p "$root$place"
cp "$out"/restage_*.{dsc,debian.tar.xz,orig.tar.gz} "$root$place/"
in_system "$root" "cd $place
  apt-get update && apt-get build-dep -y --no-install-recommends ./restage_*.dsc
  dpkg-source -x restage_*.dsc source && cd source && dpkg-buildpackage -us -uc -b -j\$JOBS"
cp "$root$place"/*.{deb,changes,buildinfo} "$out/"
rm -rf "$root"
