#!/bin/sh
# Calibrates twenty hidden worlds and compares what was found with what is true: the table "Twenty worlds"
# of docs/results.md.
#
#   docs/results/calibration.sh OUT_FOLDER [quarter|full]
#
# FIRST_SEED and LAST_SEED (1 and 20) choose the worlds. A world takes 40 s at a quarter of the pixels and
# five minutes at full size, on two cores. What the steps saw stays in OUT_FOLDER, so that a run is gone on with.
set -eu

out=$1
size=${2:-quarter}
root=$(cd "$(dirname "$0")/../.." && pwd)
"$root/dev" build bench calibration_recovery
mkdir -p "$out"
exec "$root/build/bench/bin/calibration_recovery" "$size" "${FIRST_SEED:-1}" "${LAST_SEED:-20}" "$out"
