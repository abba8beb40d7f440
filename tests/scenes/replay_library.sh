#!/usr/bin/env bash
# Records every scene of the library, replays it, and compares sound and events with those of `carom render`,
# byte for byte. Prints the bytes of a second of each run. By hand: the shapes of some take long to solve.
#   tests/scenes/replay_library.sh build/release/carom
set -euo pipefail
cd "$(dirname "$0")/../.."
carom=${1:?expected the carom command}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
for scene in scenes/library/*.json; do
  name=$(basename "$scene" .json)
  "$carom" render "$scene" -o "$work/a.wav" --events "$work/a.csv" >/dev/null 2>&1
  report=$("$carom" record "$scene" -o "$work/run.carom" --json 2>/dev/null)
  "$carom" replay "$work/run.carom" -o "$work/b.wav" --events "$work/b.csv" >/dev/null 2>&1
  verdict=same
  cmp -s "$work/a.wav" "$work/b.wav" && cmp -s "$work/a.csv" "$work/b.csv" || { verdict=DIFFERENT; failed=1; }
  python3 -c 'import json, sys
run = json.loads(sys.argv[1])
rate = run["bytes"] / run["duration_s"] / 1e3
print(f"{sys.argv[2]:24} {sys.argv[3]:10} {rate:9.2f} kB/s")' "$report" "$name" "$verdict"
done
exit $failed
