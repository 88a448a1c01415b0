#!/bin/sh
# Calibrates a simulated rig of which nothing is where the drawing has it, and measures known materials
# with what was found: the table "Measured with that calibration" of docs/results.md.
#
#   docs/results/calibration_end_to_end.sh OUT_FOLDER
#
# SEED of the hidden world (default 1), TILT_SEEDS of the worlds with a leaning sample (default "1 2 3").
# A calibration that lies in OUT_FOLDER from before is gone on with. Takes three minutes on two cores.
set -eu

out=$1
seed=${SEED:-1}
here=$(cd "$(dirname "$0")" && pwd)
rig=$here/../../rigs/uncalibrated.toml
glossy=steel-ground # m = 0.105 in its narrow lobe
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$here/common.sh"

# A plate of one value everywhere, the same double (240) in all three planes of a MERL file.
plate() {
  printf '\000\000\000\000\000\000\156\100' > "$work/value"
  size=8
  while [ $size -lt 34992000 ]; do
    cat "$work/value" "$work/value" > "$work/twice"
    mv "$work/twice" "$work/value"
    size=$((2 * size))
  done
  printf '\132\000\000\000\132\000\000\000\264\000\000\000' > "$work/plate.binary"
  head -c 34992000 "$work/value" >> "$work/plate.binary"
  rm "$work/value"
}

cat > "$work/directions.csv" << 'EOF'
theta_h_deg,theta_d_deg,phi_d_deg
3,12,28
10,20,90
20,30,45
30,10,120
5,40,90
15,30,130
40,20,60
2,55,100
25,40,150
10,25,10
10,60,80
5,65,95
35,45,90
45,30,30
EOF

# off MATERIAL ALIGNMENT THETA_MAX THETA_H_MAX: measures, and says how far all spots with theta_i and
# theta_o up to THETA_MAX and theta_h up to THETA_H_MAX are off the material, in per cent.
off() {
  rm -rf "$work/session"
  "$gonio" measure "$rig" --calibration "$out/calibration" --alignment "$2" --material "$1" \
    --plan "$work/directions.csv" --seed "$seed" --out "$work/session" -q < /dev/null
  "$gonio" reduce "$work/session" --out "$work/found.csv" --force -q
  "$gonio" sample "$1" --directions "$work/found.csv" --out "$work/truth.csv" --force -q
  deviations "$3" "$4"
}

deviations() {
  paste -d, "$work/found.csv" "$work/truth.csv" | grep -v '^#' | awk -F, -v most="$1" -v half="$2" '
    function degrees(c) { return atan2(sqrt(c < 1 ? 1 - c * c : 0), c) / rad }
    BEGIN { rad = atan2(0, -1) / 180 }
    NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "theta_h_deg") second = i; next }
    { a = cos($1 * rad) * cos($2 * rad); b = sin($1 * rad) * sin($2 * rad) * cos($3 * rad)
      if ($1 > half || degrees(a - b) > most || degrees(a + b) > most) next
      for (c = 0; c < 3; ++c) {
        d = 100 * ($(4 + c) / $(second + 3 + c) - 1); print d < 0 ? -d : d
      } }' | sort -g | awk -v most="$1" -v half="$2" '
    { d[NR] = $1 }
    END { printf "%d values to %g deg, theta_h to %g: median %.2f %%, 95th percentile %.2f %%, largest %.2f %%\n",
                 NR, most, half, d[int(0.5 * NR) + 1], d[int(0.95 * NR) + 1], d[NR] }'
}

"$gonio" calibrate "$rig" --out "$out/calibration" --yes --seed "$seed" -q
plate
"$gonio" align "$rig" --calibration "$out/calibration" --seat-sigma 0.3 --out "$work/seat.json"
printf 'plate:          '
off "$work/plate.binary" "$work/seat.json" 60 90
for diffuse in ivory-wall-latex grey-abs; do
  printf '%-16s' $diffuse:
  off builtin:$diffuse "$work/seat.json" 75 90
done
"$gonio" align "$rig" --calibration "$out/calibration" --material builtin:$glossy --seed "$seed" \
  --out "$work/highlight.json" -q
printf '%-16s' $glossy:
off builtin:$glossy "$work/highlight.json" 80 15

# What a lean of 0.2 deg rms about x and y (0.3 deg together) costs once it is aligned: PSNR of the
# reconstructed BRDF against the material, the sample straight and leaning. Both are aligned.
"$gonio" train builtin --exclude $glossy --out "$work/basis.h5" -q
"$gonio" plan --basis "$work/basis.h5" --samples 10 --rig "$here/../../rigs/simulated.toml" \
  --out "$work/plan.csv" -q
# Directions only: joints are those of the sample as it lies.
grep -v '^#' "$work/plan.csv" | cut -d, -f1-3 > "$work/list.csv"
for tilt_seed in ${TILT_SEEDS:-1 2 3}; do
  for tilt in 0 0.2; do
    printf '[simulation]\ntilt_rms_deg = %s\n' $tilt > "$work/rig.toml"
    "$gonio" align "$work/rig.toml" --material builtin:$glossy --seed "$tilt_seed" \
      --out "$work/leaning.json" --force -q > "$work/aligned"
    rm -rf "$work/session"
    "$gonio" measure "$work/rig.toml" --alignment "$work/leaning.json" --material builtin:$glossy \
      --plan "$work/list.csv" --seed "$tilt_seed" --out "$work/session" -q < /dev/null
    reconstruct "$work/session" --basis "$work/basis.h5" --out "$work/found.binary"
    echo "world $tilt_seed, rms $tilt deg: $(cat "$work/aligned"); PSNR A, B:" \
      "$(scores builtin:$glossy "$work/found.binary" | awk '{ print $5, $6 }') dB"
  done
done
