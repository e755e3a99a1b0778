#!/usr/bin/env bash
# check_debian.sh FOLDER: of the packages in FOLDER (./run package debian), as root: lintian finds no error; a second build, in
# another folder and with one process less, gives the same bytes; their tests (debian/tests) pass in a bare Debian 12 that has
# nothing else. Exit code 77: bare systems cannot be made here.
set -euo pipefail
folder=$(readlink -f "$1")
package=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/../../cmake/package
# shellcheck source=cmake/package/bare.sh
. "$package/bare.sh"

timed 'lintian' lintian --fail-on error --allow-root "$folder"/restage_*.changes "$folder"/restage_*.dsc
cat "$folder/last.log"
make_bare bookworm "$folder/root"
timed 'tests of the packages' autopkgtest "$folder"/*.deb "$folder"/restage_*.dsc -- chroot "$folder/root"
grep -E '^(program|python|library) +' "$folder/last.log"

again=$folder/again
rm -rf "$again" && mkdir "$again"
cp "$folder"/restage_*.{dsc,debian.tar.xz,orig.tar.gz} "$again/"
timed 'second build' env JOBS=1 "$package/debian.sh" "$again" /srv/another/folder
for deb in "$folder"/*.deb; do cmp "$deb" "$again/$(basename "$deb")"; done
echo 'the same bytes'
