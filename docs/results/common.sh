# Shared by the scripts beside it; they set `work`, a scratch folder, and source this.
# GONIO names the program (default: gonio on the path).
gonio=${GONIO:-gonio}

# The number behind a key of a --json answer on standard input.
number() { sed -n "s/.*\"$1\": *\([-+0-9.eE]*\).*/\1/p" | head -n 1; }

# reconstruct ARGS..: exit status 5 says "do not trust", and how wrong it is is what is asked here.
reconstruct() { "$gonio" reconstruct "$@" --no-bands --force -q > /dev/null || [ $? -eq 5 ]; }

# scores TRUTH FOUND: raw RMSE, weighted log RMSE, grazing RMSE and bias, PSNR A, B, dE00 on a line.
scores() {
  "$gonio" compare "$1" "$2" --json > "$work/compare.json"
  for key in raw_rmse_per_sr weighted_log_rmse grazing_log_rmse grazing_log_bias psnr_a_db \
    psnr_b_db mean_delta_e_a; do
    number $key < "$work/compare.json"
  done | tr '\n' ' '
  echo
}
