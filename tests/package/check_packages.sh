#!/usr/bin/env bash
# check_packages.sh DEB TARBALL FOLDER [SUITE...]: both packages (./run package) in bare systems, as root.
# The .deb in a bare Debian 12: the program, the module for Python, another project that links the library. The tarball
# in a bare system of each SUITE (bullseye, bookworm, trixie: Debian 11 to 13). Bare systems are made once, in FOLDER/bare.
# Exit code 77: bare systems cannot be made here.
set -euo pipefail
deb=$(readlink -f "$1") tarball=$(readlink -f "$2") folder=$3
shift 3
suites=("$@")
[ ${#suites[@]} -gt 0 ] || suites=(bullseye bookworm trixie)
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
mirror=$(awk '/^URIs:/ { print $2; exit } $1 == "deb" { for (i = 2; i <= NF; ++i) if ($i ~ /^http/) { print $i; exit } }' \
  /etc/apt/sources.list.d/*.sources /etc/apt/sources.list 2> /dev/null)
mkdir -p "$folder/bare"
root=$(readlink -f "$folder")/root

# bare SUITE: a fresh $root.
bare() {
  local kept=$folder/bare/$1
  if [ ! -e "$kept/done" ]; then
    rm -rf "$kept"
    debootstrap --variant=minbase "$1" "$kept" "$mirror" > "$folder/$1.log" 2>&1 || { tail -n 3 "$folder/$1.log"; exit 77; }
    touch "$kept/done"
  fi
  rm -rf "$root"
  cp -a "$kept" "$root"
}

# inside COMMANDS: in the fresh system, as a newcomer there.
inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 chroot "$root" sh -ec "$1"; }

# What is typed first: is all well; clouds (of the smallest training's test, so that nothing must be downloaded); a character.
first='cd /var/tmp
"$restage" doctor --self
"$restage" train h4d/smoke --quiet
"$restage" eval run=$(echo runs/*) --out walk > eval.md
"$restage" retarget --source walk/source.h5 --target walk/target.ply --out walk.glb
test -s walk.glb
"$restage" reproduce rekik2024 --table 10 --budget lite --no-run --out page > /dev/null && test -s page/rekik2024.md'

# timed TITLE COMMAND...
timed() {
  local title=$1 start=$SECONDS
  shift
  "$@" > "$folder/last.log" 2>&1 || { cat "$folder/last.log"; echo "failed: $title"; exit 1; }
  printf '%4d s  %s\n' $((SECONDS - start)) "$title"
}

bare bookworm
cp "$deb" "$root/opt/restage.deb"
# Without proc there is no /proc/self/exe.
mount --bind /proc "$root/proc" || exit 77
trap 'umount "$root/proc" 2> /dev/null || true' EXIT
timed 'Debian 12: apt-get update' inside 'apt-get update'
timed 'Debian 12: the .deb is installed' inside 'apt-get install -y /opt/restage.deb'
timed 'Debian 12: first result' inside "restage=restage; $first"
timed 'Debian 12: no compiler is there' inside '! command -v cc && ! command -v g++'
timed 'Debian 12: manual page and completion' inside 'test -s /usr/share/man/man1/restage.1* && test -s /usr/share/bash-completion/completions/restage'
timed 'Debian 12: the module for Python' inside 'cd /var/tmp && python3 -c "
import numpy, restage
system = restage.System(\"walk/target.ply\")
print(restage.__version__, system)
frame = system.push(numpy.random.default_rng(0).normal(size=(900, 3)) * [0.2, 0.5, 0.1] + [0, 1, 0])
print(frame.vertices.shape)"'
cp -r "$here/../install" "$root/opt/consumer"
timed 'Debian 12: what the library needs is installed' inside \
  'apt-get install -y --no-install-recommends $(apt-cache show /opt/restage.deb | sed -n "s/^Suggests: //p" | tr -d ,)'
timed 'Debian 12: another project is built' inside \
  'cmake -S /opt/consumer -B /opt/consumer/build -G Ninja -DCMAKE_BUILD_TYPE=Release && cmake --build /opt/consumer/build && /opt/consumer/build/consumer'
umount "$root/proc"
for suite in "${suites[@]}"; do
  bare "$suite"
  mount --bind /proc "$root/proc"
  timed "$suite: the tarball is unpacked" tar -xzf "$tarball" -C "$root/opt"
  timed "$suite: first result" inside "restage=\$(echo /opt/restage-*/bin/restage); $first"
  umount "$root/proc"
done
