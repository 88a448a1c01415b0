#!/bin/sh
# Remakes the sample-count study of docs/results.md: what more directions, chosen by chance, bring.
#
#   docs/results/sample_count.sh FOLDER_OF_MERL_FILES OUT_FOLDER
#
# Directions are drawn evenly from the indices of the MERL lattice, above the horizon with theta_i and
# theta_o up to 80 deg: independent, or a walk of one cell along each index with 30 % of its steps
# anywhere (what a scan that follows itself gives). OUT_FOLDER gets sample-count.md.
set -eu

merl=$1
out=$2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

# directions COUNT SEED GLOBAL: GLOBAL is the share of steps that go anywhere, 1 for independent ones.
directions() {
  awk -v count="$1" -v seed="$2" -v anywhere="$3" '
    function step() { return int(3 * rand()) - 1 }
    function inside(th, td, pd,   a, b, p, ci, co) {
      a = th * deg; b = td * deg; p = pd * deg
      # Heights of light and detector: cos(theta_h) cos(theta_d) -+ sin(theta_h) sin(theta_d) cos(phi_d)
      ci = cos(a) * cos(b) - sin(a) * sin(b) * cos(p)
      co = cos(a) * cos(b) + sin(a) * sin(b) * cos(p)
      return ci > lowest && co > lowest
    }
    BEGIN {
      srand(seed); deg = atan2(0, -1) / 180; lowest = cos(80 * deg)
      print "theta_h_deg,theta_d_deg,phi_d_deg"
      h = -1
      while (made < count) {
        if (h < 0 || rand() < anywhere) { i = int(90 * rand()); j = int(90 * rand()); k = int(180 * rand()) }
        else { i = h + step(); j = d + step(); k = (q + step() + 180) % 180 }
        if (i < 0 || i > 89 || j < 0 || j > 89) continue
        th = 90 * ((i + 0.5) / 90) ^ 2; td = j + 0.5; pd = k + 0.5
        if (!inside(th, td, pd)) continue
        h = i; d = j; q = k
        # A direction is measured once.
        if (seen[i, j, k]++) continue
        printf "%.6f,%.1f,%.1f\n", th, td, pd
        ++made
      }
    }'
}

# row NAME COUNT KIND ARGS..: figures of the directions in list.csv and of what they find.
row() {
  name=$1 count=$2 kind=$3
  shift 3
  "$gonio" sample "$merl/$name.binary" --directions "$work/list.csv" "$@" --out "$work/s.csv" --force -q
  "$gonio" plan --basis "$work/basis.h5" --directions "$work/list.csv" --explain --json \
    --out "$work/ordered.csv" --force -q > "$work/plan.json"
  for method in ridge auto; do
    reconstruct "$work/s.csv" --basis "$work/basis.h5" --method $method --out "$work/found.binary"
    scores "$merl/$name.binary" "$work/found.binary"
  done | tr '\n' ' ' | awk -v head="| $name | $count | $kind" \
    -v condition="$(number condition_number < "$work/plan.json")" \
    -v xu="$(number xu_metric < "$work/plan.json")" '
    { printf "%s | %.0f | %.1f | %.1f | %.1f | %.4f | %.4f | %.2f |\n", head, condition, xu, $5, $12,
             $2, $9, $8 }' >> "$out/sample-count.md"
}

{
  echo "| left out | samples | directions | condition number | Xu metric | PSNR ridge | PSNR auto |" \
    "log RMSE ridge | log RMSE auto | raw RMSE auto |"
  echo "|---|---|---|---|---|---|---|---|---|---|"
} > "$out/sample-count.md"
for name in green-plastic alum-bronze light-red-paint; do
  "$gonio" train "$merl" --exclude $name --out "$work/basis.h5" --force -q
  for count in 10 20 50 200 2000 8000; do
    directions $count 1 1 > "$work/list.csv"
    row $name $count independent
    directions $count 1 0.3 > "$work/list.csv"
    row $name $count walk
  done
  "$gonio" plan --near-field --shots 2 --fov 25 --basis "$work/basis.h5" --out "$work/shots.csv" \
    --force -q > /dev/null
  "$gonio" sample "$merl/$name.binary" --directions "$work/shots.csv" --near-field --fov 25 \
    --out "$work/pixels.csv" --force -q
  sed '/^#/d' "$work/pixels.csv" | cut -d, -f1-3 > "$work/list.csv"
  row $name "$(($(wc -l < "$work/list.csv") - 1))" "two shots of 25 deg"
done
