# Bare Debian systems, for building and testing packages; sourced by bash scripts. Needs root and debootstrap.
bare_systems=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/../../build/bare

# The mirror that this machine's apt uses.
debian_mirror() {
  awk '/^URIs:/ { print $2; exit } $1 == "deb" { for (i = 2; i <= NF; ++i) if ($i ~ /^http/) { print $i; exit } }' \
    /etc/apt/sources.list.d/*.sources /etc/apt/sources.list 2> /dev/null
}

# make_bare SUITE FOLDER: a fresh system of SUITE (bullseye, bookworm, trixie: Debian 11 to 13) in FOLDER, copied from one that is
# made once. Exit code 77: that cannot be done here.
make_bare() {
  local kept=$bare_systems/$1
  if [ ! -e "$kept/done" ]; then
    rm -rf "$kept"
    mkdir -p "$kept"
    debootstrap --variant=minbase "$1" "$kept" "$(debian_mirror)" > "$kept.log" 2>&1 || { tail -n 3 "$kept.log"; exit 77; }
    in_system "$kept" true || exit 77  # mounting is not allowed here
    touch "$kept/done"
  fi
  rm -rf "$2"
  cp -a "$kept" "$2"
}

# in_system FOLDER COMMANDS: in that system, as a newcomer there. Mounts end with it.
in_system() {
  unshare -m sh -ec 'mount --bind /proc "$1/proc"; exec env -i PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
    LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive JOBS="$3" chroot "$1" sh -ec "$2"' sh "$1" "$2" "${JOBS:-$(nproc)}"
}

# timed TITLE COMMAND...: with what it said in $folder/last.log, which is shown if it fails.
timed() {
  local title=$1 start=$SECONDS
  shift
  "$@" > "$folder/last.log" 2>&1 || { tail -n 50 "$folder/last.log"; echo "failed: $title"; exit 1; }
  printf '%4d s  %s\n' $((SECONDS - start)) "$title"
}
