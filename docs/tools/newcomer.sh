#!/usr/bin/env bash
# A newcomer's way with a clock: from a clone to a verdict on an own estimator.
#     docs/tools/newcomer.sh rust|c|python [TARGET [here]]
# Clones the repository that the script is in, builds, runs the README's scenario, makes an own estimator with `monorig new estimator`, tests
# it and compares it with ours. TARGET is the target folder of an earlier build; without it everything is built. With `here` the repository is
# not cloned, so that nothing of it is built anew. `python` needs the package `monorig` (`pip install ./interfaces/python`). Prints the seconds of each
# step and the last line that it printed.
set -euo pipefail
language=$1 repository=$(realpath "$(dirname "$0")/../..") work=$(mktemp -d)
export CARGO_TARGET_DIR=${2:-$work/target} NO_COLOR=1
trap 'rm -rf "$work"' EXIT
timed() { # what, command …
  local what=$1 from=$EPOCHREALTIME code=0
  shift
  "$@" >"$work/out" 2>"$work/err" || code=$?
  printf '%7.1f s  exit %d  %-28s %s\n' "$(awk "BEGIN {print $EPOCHREALTIME - $from}")" "$code" "$what" "$(tail -qn 1 "$work/err" "$work/out" | tail -1)"
}
if [ "${3:-}" = here ]; then
  cd "$repository"
else
  timed clone git clone --quiet "$repository" "$work/monorig"
  cd "$work/monorig"
fi
timed build cargo build --release
PATH=$CARGO_TARGET_DIR/release:$PATH
export MONORIG_OUT=$work/runs
timed "run of the README" monorig run scenarios/liu2023_section1.yaml
timed report monorig report "$MONORIG_OUT/liu2023_section1/1"
timed new-estimator monorig new estimator "$language" "$work/my_filter" --monorig .
cd "$work/my_filter"
case $language in
rust)
  program="$CARGO_TARGET_DIR/release/my_filter"
  timed "its build" cargo build --release
  ;;
c)
  program=monorig
  timed "its build" make
  ;;
python)
  timed "its test" python test_climb.py
  exit
  ;;
esac
timed "its verdict" "$program" test climb.yaml
timed "beside ours, ten seeds" "$program" compare climb.yaml --estimators mine,rail_fusion --seeds 1..10
