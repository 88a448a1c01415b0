#!/bin/sh
# Kills `gonio measure` with SIGKILL at random instants, resumes, and compares samples and the
# reconstructed .binary with those of the uninterrupted session, byte by byte.
#
#   docs/results/kill_sweep.sh OUT_FOLDER
#
# KILLS (default 1000). The kills at every write, sync and rename, with power cuts and failing disks,
# are `GONIO_KILL_SWEEP=all kill_sweep_test`. Prints one line per session that differs, then how many
# were killed how far. Needs bash's or another shell's `sleep` with fractions.
set -eu

out=$1
kills=${KILLS:-1000}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

cat > "$work/rig.toml" <<END
[camera]
width_px = 80
height_px = 64
fx_px = 345.0
fy_px = 345.0
cx_px = 39.5
cy_px = 31.5
[session]
white_frames = 1
dark_frames = 2
[simulation]
homing_sigma_deg = 0.0
positioning_sigma_deg = 0.0
lamp_drift_sigma = 0.0
same_noise_again = true
END
"$gonio" train builtin --exclude red-pmma --out "$work/basis.h5" -q
"$gonio" plan --basis "$work/basis.h5" --samples 12 --rig "$work/rig.toml" --out "$work/plan.csv" -q

measure() {
  "$gonio" measure "$work/rig.toml" --plan "$work/plan.csv" --material builtin:red-pmma --out "$1" -q
}
# Where the rows come from stands above them and differs.
results() {
  "$gonio" reduce "$1" --out "$1.csv" -q
  reconstruct "$1.csv" --basis "$work/basis.h5" --out "$1.binary"
  { grep -v '^#' "$1.csv"; cat "$1.binary"; } | sha256sum
}

began=$(date +%s%N)
measure "$work/whole"
took_ms=$((($(date +%s%N) - began) / 1000000))
wanted=$(results "$work/whole")
echo "uninterrupted: $took_ms ms"

killed=0 finished=0 never_begun=0 different=0
for i in $(seq "$kills"); do
  session=$work/session
  rm -rf "$session" "$session.csv" "$session.binary" "$session.json" "$session.uncertainty.h5"
  measure "$session" &
  process=$!
  sleep "$(awk -v seed="$i" -v ms="$took_ms" 'BEGIN { srand(seed); printf "%.4f", rand() * ms / 1000 }')"
  kill -9 "$process" 2> /dev/null || true
  if wait "$process" 2> /dev/null; then finished=$((finished + 1)); else killed=$((killed + 1)); fi
  if ! "$gonio" resume "$session" --outage "$i" -q 2> "$work/error"; then
    # Killed before there was anything to go on with.
    if [ -e "$session/frames/000001.tiff" ]; then
      different=$((different + 1))
      echo "kill $i: not resumed: $(cat "$work/error")"
    fi
    never_begun=$((never_begun + 1))
    continue
  fi
  if [ "$(results "$session")" != "$wanted" ]; then
    different=$((different + 1))
    echo "kill $i: differs"
  fi
done
echo "$killed killed, $finished had finished, $never_begun had never begun, $different different or lost"
[ "$different" = 0 ]
