#!/usr/bin/env bash
# image.sh TARBALL OUT.tar: an OCI image (an archive that podman and skopeo read) of what the tarball holds, as root. The tarball
# brings its own C library, so the image has no system: the program, BusyBox, the certificates for `restage data fetch`.
set -euo pipefail
tarball=$(readlink -f "$1") out=$(readlink -m "$2")
place=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
root=$folder/context/root

mkdir -p "$root"/{bin,etc/ssl/certs,opt/restage,tmp} "$folder/context/work"
chmod 1777 "$root/tmp"
# Without the library and the module for Python, which nothing in the image could use.
tar -xzf "$tarball" -C "$root/opt/restage" --strip-components=1 --no-same-owner \
  --exclude='*.a' --exclude='*/include' --exclude='*/cmake' --exclude='*/python3'
cp "$(command -v busybox)" "$root/bin/"
chroot "$root" /bin/busybox --install -s /bin
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
echo 'restage:x:1000:1000::/work:/bin/sh' > "$root/etc/passwd"
echo 'restage:x:1000:' > "$root/etc/group"

rm -f "$out"
# The same input gives the same digest.
buildah --storage-driver vfs --root "$folder/store" --runroot "$folder/run" bud --timestamp 0 -f "$place/Containerfile" \
  -t "oci-archive:$out:$(basename "$tarball" | sed 's/^restage-\(.*\)-linux-x86_64.tar.gz$/\1/')" "$folder/context"
