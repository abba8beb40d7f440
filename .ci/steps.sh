# Sourced by .ci/run: how its steps are told and run.

# Each step with the minutes since the start, and the CPU minutes that the one before has taken.
last_step="" last_cpu=0
times_file=$(mktemp)
trap 'rm -f "$times_file"' EXIT
step() {
  times >"$times_file" # not in a pipe, which would be a shell of its own
  local cpu
  cpu=$(awk 'NR == 2 { split($1, user, /[ms]/); split($2, kernel, /[ms]/)
                       print int(60 * (user[1] + kernel[1]) + user[2] + kernel[2]) }' "$times_file")
  [ -z "$last_step" ] ||
    printf -- '-- %s: %d:%02d CPU minutes\n' "$last_step" $(((cpu - last_cpu) / 60)) $(((cpu - last_cpu) % 60))
  last_step=$1 last_cpu=$cpu
  printf '\n== %s (at %d:%02d, %d CPU minutes)\n' "$1" $((SECONDS / 60)) $((SECONDS % 60)) $((cpu / 60))
}
# run_tests PRESET LOG OPTION...: ctest, of which only failures and the last lines are shown.
run_tests() {
  local preset=$1 log=$2
  shift 2
  ctest --preset "$preset" -j "$(nproc)" --no-tests=error --quiet --output-log "$log" "$@" ||
    { grep -v Passed "$log" | tail -n 60; return 1; }
  tail -n 4 "$log"
}
