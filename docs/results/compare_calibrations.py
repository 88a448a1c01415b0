"""Two calibrations of one rig, parameter by parameter: |a - b| / hypot(sigma_a, sigma_b).

compare_calibrations.py FOLDER_A FOLDER_B

What neither run measured (no sigma, or the operator's own figure) is left out, and so is what says how
bright the lamp was at the time.
"""
import json
import math
import sys

GIVEN = {"sample_plane"}
# What the lamp did at the time: it drifts, and a run at another pace sees another part of its warm-up.
LAMP = {"warm_up"}
DRIFTS = {"sensor.rate_dn_per_s"}


def parameters(folder):
    with open(f"{folder}/calibration.json", encoding="utf-8") as file:
        archive = json.load(file)
    found = {}
    for step in archive["results"]:
        names = step["parameters"]
        for i, each in enumerate(names):
            variance = step["covariance"][i * (len(names) + 1)]
            found[step["step"], each["name"]] = (each["value"], math.sqrt(variance))
    return found


def main():
    one, other = (parameters(folder) for folder in sys.argv[1:3])
    steps = {}
    for key in one.keys() & other.keys():
        (a, sigma_a), (b, sigma_b) = one[key], other[key]
        sigma = math.hypot(sigma_a, sigma_b)
        if sigma > 0.0 and a != b and key[0] not in GIVEN | LAMP and key[1] not in DRIFTS:
            steps.setdefault(key[0], []).append((abs(a - b) / sigma, key[1], a, b, sigma))
    every = []
    for step in dict.fromkeys(key[0] for key in one):
        rows = sorted(steps.get(step, []), reverse=True)
        if not rows:
            continue
        every += rows
        z, name, a, b, sigma = rows[0]
        chi2 = sum(row[0] ** 2 for row in rows) / len(rows)
        print(f"{step:16} {len(rows):3}  chi^2/dof {chi2:6.2f}  largest {z:5.2f} {name}"
              f"  {a:.7g} {b:.7g} +- {sigma:.2g}")
    chi2 = sum(row[0] ** 2 for row in every) / len(every)
    beyond = sum(row[0] > 2.0 for row in every)
    print(f"all: {len(every)} parameters, chi^2/dof {chi2:.2f}, {beyond} beyond 2 sigma, "
          f"largest {max(every)[0]:.2f}")
    missing = sorted(f"{step}: {name}" for step, name in one.keys() ^ other.keys())
    if missing:
        sys.exit(f"found in one of them only: {', '.join(missing)}")


main()
