#!/bin/sh
# Calibrates one hidden world twice, in process and over the wire, and compares what was found: the
# section "Calibration over the wire" of docs/results.md. Takes a quarter of an hour.
#
#   docs/results/calibration_wire.sh OUT_FOLDER
#
# SEED (default 1), TIME_SCALE (default 20), RECOVERY (the program calibration_recovery_of; left out:
# no comparison with the truth). Both runs stay in OUT_FOLDER, and are gone on with when they are there.
set -eu

out=$1
seed=${SEED:-1}
here=$(cd "$(dirname "$0")" && pwd)
rigs=$here/../../rigs
mkdir -p "$out"
work=$out
. "$here/common.sh"

"$gonio" calibrate "$rigs/uncalibrated.toml" --out "$out/in_process" --seed "$seed" --yes -q > "$out/in_process.txt"
"${gonio%gonio}gonio-emulate" "$rigs/uncalibrated_wire.toml" --seed "$seed" \
  --noise-seed "$((seed + 1000))" --time-scale "${TIME_SCALE:-20}" --account "$out/account.json" -- \
  "$gonio" calibrate "$rigs/uncalibrated_wire.toml" --out "$out/wire" --yes -q > "$out/wire.txt"
cat "$out/account.json"
python3 "$here/compare_calibrations.py" "$out/in_process" "$out/wire"
if [ -n "${RECOVERY:-}" ]; then
  for run in in_process:uncalibrated wire:uncalibrated_wire; do
    echo "${run%:*} against the truth:"
    "$RECOVERY" "$rigs/${run#*:}.toml" "$seed" "$out/${run%:*}"
  done
fi
