#!/bin/sh
# Measures what the drivers cost in a whole session over the wire, at real pace: the section "On the
# wire" of docs/results.md. Takes about three minutes, most of them the session itself.
#
#   docs/results/wire.sh OUT_FOLDER
#
# POSES (default 10), MATERIAL (default builtin:gold-satin), TIME_SCALE (default 1). Prints where the
# time went, how the samples compare with those of a session in process, and the PSNR between the BRDFs
# that come out.
set -eu

out=$1
poses=${POSES:-10}
material=${MATERIAL:-builtin:gold-satin}
here=$(cd "$(dirname "$0")" && pwd)
rig=$here/../../rigs/wire.toml
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

"$gonio" train builtin --exclude "${material#builtin:}" --out "$work/basis.h5" -q
"$gonio" plan --basis "$work/basis.h5" --samples "$poses" --rig "$rig" --out "$work/plan.csv" -q
"$gonio" measure "$rig" --simulate --material "$material" --plan "$work/plan.csv" \
  --out "$work/simulated" -q
"${gonio%gonio}gonio-emulate" "$rig" --material "$material" --time-scale "${TIME_SCALE:-1}" \
  --noise-seed 2 --account "$out/account.json" -- \
  "$gonio" measure "$rig" --plan "$work/plan.csv" --out "$work/wire"
for session in simulated wire; do
  reconstruct "$work/$session" --basis "$work/basis.h5" --out "$work/$session.binary"
  "$gonio" reduce "$work/$session" --out "$work/$session.csv" -q
done
cat "$out/account.json"
"$gonio" compare "$work/simulated.binary" "$work/wire.binary"
# Sample by sample: columns 4 to 6 are the values, 7 to 9 their sigmas.
paste -d, "$work/simulated.csv" "$work/wire.csv" | awk -F, '
  /^#/ || /theta/ { next }
  { n = NF / 2
    for (c = 4; c <= 6; ++c) {
      z = ($c - $(n + c)) / sqrt($(c + 3) ^ 2 + $(n + c + 3) ^ 2); sum += z; squares += z * z; ++count
    } }
  END { printf "samples: %d values, mean z %.3f, chi^2/dof %.3f\n", count, sum / count, squares / count }'
