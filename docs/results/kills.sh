#!/bin/sh
# Kills sessions: at every write, sync and rename of their archive (killed, killed in half a write, power cut,
# disk full or broken), and the real program at random instants. The section "Sessions that were killed" of
# docs/results.md.
#
#   docs/results/kills.sh OUT_FOLDER
#
# KILLS (1000) are the random ones, in two lots side by side. Builds build/kills first, so that other builds do not change the programs
# under it. What was seen stands in OUT_FOLDER/*.log.
set -eu

out=$1
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$root/build/kills
mkdir -p "$out"
cmake -S "$root" -B "$build" --preset test > "$out/build.log"
cmake --build "$build" --target random_kills_test kill_sweep_test >> "$out/build.log"
{
  date -u
  git -C "$root" rev-parse --short HEAD
} > "$out/kills.log"
half=$((${KILLS:-1000} / 2))
failed=0
GONIO_KILLS=$half GONIO_KILL_SEED=1 "$build/bin/random_kills_test" > "$out/kills.1.log" 2>&1 &
GONIO_KILLS=$half GONIO_KILL_SEED=2 "$build/bin/random_kills_test" > "$out/kills.2.log" 2>&1 || failed=1
wait $! || failed=1
GONIO_KILL_SWEEP=all "$build/bin/kill_sweep_test" > "$out/sweep.log" 2>&1 || failed=1
for log in kills.1 kills.2 sweep; do tail -n 12 "$out/$log.log"; done
exit $failed
