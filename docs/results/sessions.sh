#!/bin/sh
# Remakes the row "whole sessions" of docs/results.md: every third material measured by the simulated
# rig (full sensor noise, sample tilted by 0.05 deg), reduced and reconstructed from a basis and poses
# of the other folds.
#
#   docs/results/sessions.sh FOLDER_OF_MERL_FILES OUT_FOLDER
#
# COMPONENTS of the basis (default: the program's), POSES (default 10). Fold of a material: its place in
# the list of all, modulo 5. OUT_FOLDER gets sessions.csv and, last, its means on standard output.
set -eu

merl=$1
out=$2
poses=${POSES:-10}
here=$(cd "$(dirname "$0")" && pwd)
rig=$here/../../rigs/simulated.toml
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

echo "material,raw_rmse_per_sr,weighted_log_rmse,grazing_log_rmse,grazing_log_bias,psnr_a_db,psnr_b_db,mean_delta_e_a" \
  > "$out/sessions.csv"
(cd "$merl" && ls -- *.binary) | sort | awk '{ sub(/\.binary$/, ""); print NR - 1, $0 }' > "$work/list"
for fold in 0 1 2 3 4; do
  # shellcheck disable=SC2046  # names hold no blanks
  "$gonio" train "$merl" ${COMPONENTS:+--components "$COMPONENTS"} --out "$work/basis.h5" --force -q \
    --exclude $(awk -v fold=$fold '$1 % 5 == fold { print $2 }' "$work/list")
  "$gonio" plan --basis "$work/basis.h5" --samples "$poses" --rig "$rig" --out "$work/plan.csv" --force -q
  awk -v fold=$fold '$1 % 5 == fold && $1 % 3 == 0 { print $1, $2 }' "$work/list" > "$work/tested"
  while read -r number name; do
    rm -rf "$work/session"
    "$gonio" measure "$rig" --plan "$work/plan.csv" --material "$merl/$name.binary" \
      --seed "$((number + 1))" --out "$work/session" -q < /dev/null
    "$gonio" reduce "$work/session" --out "$work/samples.csv" --force -q
    reconstruct "$work/samples.csv" --basis "$work/basis.h5" --out "$work/found.binary"
    echo "$name,$(scores "$merl/$name.binary" "$work/found.binary" | sed 's/ $//; s/ /,/g')" \
      >> "$out/sessions.csv"
  done < "$work/tested"
done
awk -F, 'NR > 1 { n++; psnr += $6; grazing += $4; bias += $5 }
  END { printf "%d sessions: PSNR A %.2f dB, grazing log RMSE %.3f, its bias %+.4f\n", n, psnr / n,
               grazing / n, bias / n }' "$out/sessions.csv"
