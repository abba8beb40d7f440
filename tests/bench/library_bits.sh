#!/usr/bin/env bash
# Prints the SHA-256 of what the program renders of each scene of the library on each stepper, and of
# its events, so that two builds can be compared bit for bit:
#
#   tests/bench/library_bits.sh build/demo/carom scenes/library >before.txt; ...; diff before.txt after.txt
#
# Of the events it takes the columns that all builds have: the first fifteen. No name in the library has a comma.
# A scene that a stepper refuses is told as such. The cache of models is empty at the start.
set -euo pipefail
if [ $# -ne 2 ]; then
  echo "usage: library_bits.sh PROGRAM SCENES_FOLDER" >&2
  exit 2
fi
program=$(realpath "$1")
scenes=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export XDG_CACHE_HOME=$folder/cache
cd "$folder"
for scene in "$scenes"/*.json; do
  [ -f "$scene" ] || continue
  for stepper in native bullet; do
    name=$(basename "$scene")
    rm -f sound.wav events.csv
    if "$program" render "$scene" -o sound.wav --events events.csv --stepper "$stepper" >/dev/null 2>&1; then
      printf '%s %s %s %s\n' "$name" "$stepper" "$(sha256sum <sound.wav | cut -c1-16)" "$(cut -d, -f1-15 events.csv | sha256sum | cut -c1-16)"
    else
      printf '%s %s refused\n' "$name" "$stepper"
    fi
  done
done
