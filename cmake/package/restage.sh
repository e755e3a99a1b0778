#!/bin/sh
# Starts the program with the libraries of this package, so that it runs where the system's own are older.
here=$(dirname "$(readlink -f "$0")")
export RESTAGE_LAUNCHER="$here/restage"
exec "$here/../lib/restage/ld-linux-x86-64.so.2" --library-path "$here/../lib/restage" "$here/../lib/restage/restage" "$@"
