#!/usr/bin/env bash
# check_image.sh IMAGE.tar: the image (./run package image) has at most 150 MB, and gives its user, who has no rights, a first
# result; as root. Exit code 77: containers cannot be made here.
set -euo pipefail
image=$(readlink -f "$1")
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# shellcheck source=cmake/package/bare.sh
. "$here/../../cmake/package/bare.sh"
tool() { buildah --storage-driver vfs --root "$folder/store" --runroot "$folder/run" "$@"; }
container=$(tool from "oci-archive:$image" 2> "$folder/from.log") || { cat "$folder/from.log"; exit 77; }
inside() { tool run --isolation chroot -v "$here:/tests:ro" "$container" -- "$@"; }

size=$(stat -c %s "$image")
echo "$((size / 1000000)) MB; unpacked $(du -sm "$(tool mount "$container")" | cut -f 1) MB"
[ "$size" -le 150000000 ] || { echo "check_image.sh: $image: more than 150 MB"; exit 1; }
[ "$(inside id -u)" = 1000 ]
timed 'first result' inside sh /tests/first_result.sh restage /opt/restage/share/restage/docs/sample
! inside touch /opt/restage/file 2> "$folder/refused.log"
grep -q 'Permission denied' "$folder/refused.log"
