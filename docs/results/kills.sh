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
for seed in 1 2; do
  GONIO_KILLS=$half GONIO_KILL_SEED=$seed "$build/bin/random_kills_test" > "$out/kills.$seed.log" 2>&1 &
done
wait
GONIO_KILL_SWEEP=all "$build/bin/kill_sweep_test" > "$out/sweep.log" 2>&1 || true
tail -n 12 "$out"/kills.?.log "$out/sweep.log"
