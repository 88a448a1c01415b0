#!/bin/sh
# Remakes the tables and pictures of docs/results.md from a folder of MERL files.
#
#   docs/results/make.sh FOLDER_OF_MERL_FILES OUT_FOLDER
#
# GONIO names the program (default: gonio on the path), DRAWS the number of noise draws (default 5).
# Each material is left out of basis and design. OUT_FOLDER gets NAME.md and NAME-*.png per
# material; about 0.6 GB of scratch there goes away at the end.
set -eu

merl=$1
out=$2
draws=${DRAWS:-5}
here=$(cd "$(dirname "$0")" && pwd)
rig=$here/../../rigs/simulated.toml
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

# The ten directions of the student report, as printed but for (2.84, 89, 15), which is below the
# horizon.
student_nine=$work/student-nine.csv
cat > "$student_nine" <<CSV
theta_h_deg,theta_d_deg,phi_d_deg
4.01,14,16
69.3,17,151
8.1,82,48
17.77,41,92
0.9,3,33
1.87,69,145
26.67,71,56
0.01,89,59
1.87,50,70
CSV

# The mean of the lines of scores() as a table row that begins with the words given.
row() {
  awk -v head="$1" '{ for (i = 1; i <= NF; ++i) sum[i] += $i }
    END { printf "%s | %.2f | %.3f | %.3f (%+.3f) | %.1f / %.1f | %.2f |\n", head, sum[1] / NR,
          sum[2] / NR, sum[3] / NR, sum[4] / NR, sum[5] / NR, sum[6] / NR, sum[7] / NR }'
}

# measure MATERIAL LABEL DIRECTIONS METHOD [--rig FILE]: both rows of a way to measure.
measure() {
  name=$1 label=$2 directions=$3 method=$4
  shift 4
  truth=$merl/$name.binary
  "$gonio" sample "$truth" --directions "$directions" "$@" --out "$work/s.csv" --force -q
  reconstruct "$work/s.csv" --basis "$work/basis.h5" --method "$method" --out "$work/$label.binary"
  scores "$truth" "$work/$label.binary" | row "| $label, $method" >> "$work/exact.rows"
  draw=1
  while [ "$draw" -le "$draws" ]; do
    "$gonio" sample "$truth" --directions "$directions" "$@" --noise 0.03 --angle-error 0.05 \
      --seed "$draw" --out "$work/s.csv" --force -q
    reconstruct "$work/s.csv" --basis "$work/basis.h5" --method "$method" --out "$work/noisy.binary"
    scores "$truth" "$work/noisy.binary"
    draw=$((draw + 1))
  done | row "| $label, $method" >> "$work/noisy.rows"
}

# snapped MATERIAL LABEL DIRECTIONS: the row of exact values told to be those of the nearest cells,
# which is what a table look-up makes of a measurement.
snapped() {
  "$gonio" sample "$merl/$1.binary" --directions "$3" --out "$work/s.csv" --force -q
  awk -F, -v OFS=, 'function cell(x) { return (x < 179 ? int(x) : 179) + 0.5 }
    /^#/ || /theta_h/ { print; next }
    { $1 = 90 * ((int(90 * sqrt($1 / 90)) + 0.5) / 90) ^ 2; $2 = cell($2); $3 = cell($3); print }
    ' "$work/s.csv" > "$work/snapped.csv"
  reconstruct "$work/snapped.csv" --basis "$work/basis.h5" --out "$work/noisy.binary"
  scores "$merl/$1.binary" "$work/noisy.binary" | row "| $2 snapped to cells, auto" \
    >> "$work/exact.rows"
}

# picture MATERIAL LABEL
picture() {
  "$gonio" render "$work/$2.binary" --reference "$merl/$1.binary" --size 96 \
    --out "$out/$1-$2.png" --force -q
}

for name in green-plastic alum-bronze light-red-paint; do
  rm -f "$work/exact.rows" "$work/noisy.rows"
  "$gonio" train "$merl" --exclude $name --out "$work/basis.h5" --force -q
  {
    echo "### $name"
    for set in nielsen-10 "$student_nine"; do
      echo "$(basename "$set"):"
      "$gonio" plan --basis "$work/basis.h5" --directions "$set" --explain \
        --out "$work/list.csv" --force -q
    done
    echo "ours:"
    "$gonio" plan --basis "$work/basis.h5" --samples 10 --patch 0 --explain --out "$work/ours.csv" \
      --force -q
    sed '/^#/d' "$work/ours.csv"
    echo "ours-for-the-rig:"
    "$gonio" plan --basis "$work/basis.h5" --samples 10 --rig "$rig" --explain \
      --out "$work/rig.csv" --force -q
  } > "$out/$name.md"

  measure $name published-ten nielsen-10 nielsen
  picture $name published-ten
  measure $name published-ten nielsen-10 auto
  measure $name student-nine "$student_nine" nielsen
  picture $name student-nine
  measure $name student-nine "$student_nine" auto
  measure $name ours "$work/ours.csv" ridge
  measure $name ours "$work/ours.csv" auto
  picture $name ours
  measure $name ours-for-the-rig "$work/rig.csv" auto --rig "$rig"
  picture $name ours-for-the-rig
  snapped $name published-ten nielsen-10
  snapped $name student-nine "$student_nine"
  {
    echo "noise-free:"
    cat "$work/exact.rows"
    echo "3 % noise and 0.05 deg, mean of $draws draws:"
    cat "$work/noisy.rows"
  } >> "$out/$name.md"
done
