#!/usr/bin/env bash
# tarball.sh TREE NAME OUT.tar.gz: packs an installation (TREE/bin/restage, ...) so that it runs on any x86-64 Linux.
# The program goes to lib/restage with every library that it loads, glibc and its loader among them; bin/restage starts it
# (restage.sh). Nothing is taken from the system but the kernel.
set -euo pipefail
tree=$1 name=$2 out=$3
place=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -a "$tree" "$folder/$name"
cd "$folder/$name"
mkdir -p lib/restage
mv bin/restage lib/restage/restage
strip lib/restage/restage
install -m 755 "$place/restage.sh" bin/restage
ldd lib/restage/restage | awk '$2 == "=>" { print $3 } $1 ~ /^\// { print $1 }' | while read -r library; do
  cp -L "$library" lib/restage/
  # Whose library it is, and under which licence.
  package=$(dpkg -S "$(readlink -f "$library")" 2> /dev/null || dpkg -S "*${library#/usr}") && package=${package%%:*}
  mkdir -p share/doc/restage/licences
  cp "/usr/share/doc/$package/copyright" "share/doc/restage/licences/$package.txt"
done
cd ..
# The same input gives the same bytes.
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime=@0 -cf - "$name" | gzip -9n > "$out"
