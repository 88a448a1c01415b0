#!/bin/sh
# Remakes the rows "RGL materials" and "verdict over all" of docs/results.md: MERL and RGL materials in
# one training set, each left out together with its siblings (rgl_siblings.csv) and its own network.
#
#   docs/results/other_databases.sh MERL RGL_NETWORKS RGL OUT_FOLDER
#
# MERL and RGL_NETWORKS: folders of decoded networks (.binary), RGL: measured files (.bsdf). FOLDS
# (default 10). Needs python3. OUT_FOLDER gets genuine.json, merl.json, mixed.json and a summary on
# standard output.
set -eu

merl=$1
networks=$2
rgl=$3
out=$4
folds=${FOLDS:-10}
gonio=${GONIO:-gonio}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
work=$(mktemp -d "$out/work.XXXXXX")
trap 'rm -rf "$work"' EXIT

# The networks of the RGL database hold SI values: a sidecar says so. Their names get a suffix, since
# some of the measured files have the same.
mkdir "$work/networks"
for path in "$networks"/*.binary; do
  name=$(basename "$path" .binary)-network
  ln -s "$path" "$work/networks/$name.binary"
  printf '{"format": "gonio-merl-sidecar", "format_version": 1, "lattice_convention": "bin_centre",\n "radiometric_scale": "si", "binary_sha256": "%s", "provenance": {}}\n' \
    "$(sha256sum < "$path" | cut -d' ' -f1)" > "$work/networks/$name.json"
done

# Every measured RGL material left out with its siblings alone: as many folds as there are groups.
listed=$(grep -c '_rgb' "$here/rgl_siblings.csv")
groups=$(sed '/^#/d; /^material,/d' "$here/rgl_siblings.csv" | cut -d, -f2 | sort -u | wc -l)
all=$(ls -- "$merl"/*.binary "$work"/networks/*.binary "$rgl"/*.bsdf | wc -l)
# shellcheck disable=SC2046  # names hold no blanks
"$gonio" evaluate "$merl" "$work/networks" "$rgl" --folds "$((all - listed + groups))" \
  --samples 5,10,20 --scale si --siblings "$here/rgl_siblings.csv" --json \
  --score $(cd "$rgl" && ls -- *.bsdf | sed 's/\.bsdf$//') > "$out/genuine.json"
"$gonio" evaluate "$merl" --folds "$folds" --samples 10 --scale si --trust --noise 0.03 --json \
  > "$out/merl.json"
"$gonio" evaluate "$merl" "$work/networks" "$rgl" --folds "$folds" --samples 10 --scale si \
  --siblings "$here/rgl_siblings.csv" --trust --noise 0.03 --json > "$out/mixed.json"

python3 - "$out" "$merl" "$rgl" << 'PYTHON'
import json, os, sys

out, merl, rgl = sys.argv[1:]
merl_names = {f[:-7] for f in os.listdir(merl) if f.endswith(".binary")}
genuine = {f[:-5] for f in os.listdir(rgl) if f.endswith(".bsdf")}
odd = ("cc_", "chm_", "irid_", "ilm_")


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else float("nan")


def area(scores):
    bad = [s for s, failed in scores if failed]
    good = [s for s, failed in scores if not failed]
    if not bad or not good:
        return float("nan")
    return mean(1.0 if b < g else 0.5 if b == g else 0.0 for b in bad for g in good)


def verdict(rows, threshold):
    failed = [m["psnr_a_db"] < threshold for m in rows]
    flagged = [not m["trusted"] for m in rows]
    bad = sum(failed)
    hits = sum(a and b for a, b in zip(failed, flagged))
    alarms = sum(b and not a for a, b in zip(failed, flagged))
    roc = area([(m["expected_psnr_db"], m["psnr_a_db"] < threshold) for m in rows])
    return (f"area under ROC {roc:.3f}, {hits} of {bad} failures (< {threshold} dB) flagged, "
            f"{alarms} of {len(rows) - bad} others")


for result in json.load(open(os.path.join(out, "genuine.json"))):
    rows = result["materials"]
    ordinary = [m for m in rows if not m["material"].startswith(odd)]
    print(f'{result["method"]}, each measured RGL material left out with its siblings, no noise: '
          f'ordinary {mean(m["psnr_a_db"] for m in ordinary):.2f} dB '
          f'({", ".join(f"""{m["psnr_a_db"]:.1f}""" for m in ordinary)}), '
          f'others {mean(m["psnr_a_db"] for m in rows if m not in ordinary):.2f} dB')
alone = json.load(open(os.path.join(out, "merl.json")))[0]["materials"]
for result in json.load(open(os.path.join(out, "mixed.json"))):
    rows = result["materials"]
    if any("trusted" not in m for m in rows):
        continue
    print(f'{result["method"]}:')
    ordinary = [m for m in rows if m["material"] in genuine and not m["material"].startswith(odd)]
    others = [m for m in rows if m["material"] in genuine and m["material"].startswith(odd)]
    print(f'  measured RGL, ordinary ({len(ordinary)}): {mean(m["psnr_a_db"] for m in ordinary):.2f} dB')
    for m in ordinary + others:
        print(f'    {m["material"]:32} {m["psnr_a_db"]:6.2f} dB, '
              f'expected {m["expected_psnr_db"]:.1f}, {"trusted" if m["trusted"] else "flagged"}')
    print(f'  the others ({len(others)}): {sum(not m["trusted"] for m in others)} flagged, '
          f'{mean(m["psnr_a_db"] for m in others):.2f} dB')
    known = [m for m in rows if m["material"] in merl_names]
    print(f'  MERL: {mean(m["psnr_a_db"] for m in known):.2f} dB')
    print(f"  verdict, all {len(rows)}: {verdict(rows, 28)}")
    print(f"  verdict, MERL: {verdict(known, 30)}")
print(f'MERL alone, ten: {mean(m["psnr_a_db"] for m in alone):.2f} dB; verdict: {verdict(alone, 30)}')
PYTHON
