#!/usr/bin/env bash
# check_packages.sh DEB TARBALL FOLDER [SUITE...]: both packages (./run package) in bare systems, as root.
# The .deb in a bare Debian 12: the program, the module for Python, another project that links the library. The tarball
# in a bare system of each SUITE (bullseye, bookworm, trixie: Debian 11 to 13). Exit code 77: bare systems cannot be made here.
set -euo pipefail
deb=$(readlink -f "$1") tarball=$(readlink -f "$2")
mkdir -p "$3"
folder=$(readlink -f "$3")
shift 3
suites=("$@")
[ ${#suites[@]} -gt 0 ] || suites=(bullseye bookworm trixie)
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
root=$folder/root
# shellcheck source=cmake/package/bare.sh
. "$here/../../cmake/package/bare.sh"

# bare SUITE: a fresh $root with the tests in it.
bare() {
  make_bare "$1" "$root"
  cp "$here"/first_result.* "$root/opt/"
}
inside() { in_system "$root" "$1"; }

bare bookworm
cp "$deb" "$root/opt/restage.deb"
sample=/usr/share/restage/docs/sample
timed 'Debian 12: apt-get update' inside 'apt-get update'
timed 'Debian 12: the .deb is installed' inside 'apt-get install -y /opt/restage.deb'
timed 'Debian 12: first result' inside "sh /opt/first_result.sh restage $sample"
timed 'Debian 12: no compiler is there' inside '! command -v cc && ! command -v g++'
timed 'Debian 12: manual page and completion' inside 'test -s /usr/share/man/man1/restage.1* && test -s /usr/share/bash-completion/completions/restage'
timed 'Debian 12: the module for Python' inside "python3 /opt/first_result.py $sample"
cp -r "$here/../install" "$root/opt/consumer"
timed 'Debian 12: what the library needs is installed' inside \
  'apt-get install -y --no-install-recommends $(apt-cache show /opt/restage.deb | sed -n "s/^Suggests: //p" | tr -d ,)'
timed 'Debian 12: another project is built' inside \
  'cmake -S /opt/consumer -B /opt/consumer/build -G Ninja -DCMAKE_BUILD_TYPE=Release && cmake --build /opt/consumer/build && /opt/consumer/build/consumer'
for suite in "${suites[@]}"; do
  bare "$suite"
  timed "$suite: the tarball is unpacked" tar -xzf "$tarball" -C "$root/opt"
  timed "$suite: first result" inside 'cd /opt/restage-* && sh /opt/first_result.sh "$PWD/bin/restage" "$PWD/share/restage/docs/sample"'
done
