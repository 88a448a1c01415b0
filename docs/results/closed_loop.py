#!/usr/bin/env python3
"""Figures of the closed loop, from what benchmarks/accuracy/closed_loop has written.

closed_loop.py TABLE.csv... [--margin DB] [--nested]
closed_loop.py TABLE.csv --outliers

Points that fail: mean PSNR of ten points, of what is left when each fails with 20 %, and with
replacements. --until: for each wanted score, over the held-out materials that reach it within 40
points: share whose true score at the stop is at least the wanted one less 1.5 dB, points measured
and points an oracle needs, which stops at the first true score that reaches the wish. The stop is
tried at the numbers of points in the table only.
"""

import argparse
import collections
import csv

WANTED_DB = (30, 33, 36, 38)
ALLOWED_SHORT_DB = 1.5
MARGINS = [0.25 * i for i in range(13)]
KEPT_SHARE = 0.85  # 80 % are wanted


def read(paths):
    rows = []
    for path in paths:
        with open(path, newline="") as file:
            rows += list(csv.DictReader(file))
    return rows


def replacement(rows):
    by_material = collections.defaultdict(dict)
    for row in rows:
        if row["kind"] in ("ten", "failing", "replaced"):
            by_material[row["material"]][row["kind"]] = row
    complete = [each for each in by_material.values() if len(each) == 3]
    print(f"{len(complete)} materials, ten points, each failing with 20 %")
    for kind in ("ten", "failing", "replaced"):
        psnr = [float(each[kind]["psnr"]) for each in complete]
        points = [int(each[kind]["n"]) for each in complete]
        print(f"  {kind:<9} {sum(psnr) / len(psnr):6.2f} dB  {sum(points) / len(points):5.2f} points")


def histories(rows):
    """By material: (points, true score, foreseen score), ascending."""
    found = collections.defaultdict(list)
    for row in rows:
        if row["kind"] == "sequence":
            found[row["material"]].append(
                (int(row["n"]), float(row["psnr"]), float(row["expected"])))
    longest = max((len(each) for each in found.values()), default=0)
    return [sorted(each) for each in found.values() if len(each) == longest]


def stops(materials, wanted, margin):
    good, points, oracle_points, cheap = 0, [], [], 0
    for history in materials:
        oracle = next((n for n, true, _ in history if true >= wanted), None)
        if oracle is None:
            continue
        stop = next((h for h in history if h[2] - margin >= wanted), history[-1])
        good += stop[1] >= wanted - ALLOWED_SHORT_DB
        cheap += stop[0] <= 1.5 * oracle
        points.append(stop[0])
        oracle_points.append(oracle)
    return good, cheap, points, oracle_points


def until(rows, margin):
    materials = histories(rows)
    print(f"{len(materials)} materials, margin {margin:g} dB")
    print("wanted  reach it  true >= wanted - 1.5  points  oracle  ratio  <= 1.5 x oracle")
    for wanted in WANTED_DB:
        good, cheap, points, oracle = stops(materials, wanted, margin)
        count = len(points)
        if count:
            print(f"{wanted:4} dB  {count:8}  {100 * good / count:18.0f} %  "
                  f"{sum(points) / count:6.1f}  {sum(oracle) / count:6.1f}  "
                  f"{sum(points) / sum(oracle):5.2f}  {100 * cheap / count:13.0f} %")


def nested(rows):
    """Each fold with the margin that the other folds ask for: the least that keeps every wish's share
    at KEPT_SHARE or more."""
    folds = sorted({row["fold"] for row in rows})
    by_fold = {fold: histories([row for row in rows if row["fold"] == fold]) for fold in folds}
    margins = {}
    for fold in folds:
        others = [each for other in folds if other != fold for each in by_fold[other]]

        def share(margin):
            found = [stops(others, wanted, margin) for wanted in WANTED_DB]
            return min(good / len(points) for good, _, points, _ in found)

        margins[fold] = next((m for m in MARGINS if share(m) >= KEPT_SHARE), MARGINS[-1])
    print("nested, margins by fold: " + ", ".join(f"{f}: {m:g} dB" for f, m in margins.items()))
    print("wanted  reach it  true >= wanted - 1.5  points  oracle  ratio")
    for wanted in WANTED_DB:
        good, points, oracle = 0, [], []
        for fold in folds:
            right, _, taken, least = stops(by_fold[fold], wanted, margins[fold])
            good += right
            points += taken
            oracle += least
        print(f"{wanted:4} dB  {len(points):8}  {100 * good / len(points):18.0f} %  "
              f"{sum(points) / len(points):6.1f}  {sum(oracle) / len(points):6.1f}  "
              f"{sum(points) / sum(oracle):5.2f}")


def outliers(paths):
    """How often a spoiled pose is found, and others are named, by limit and by how much it is off."""
    found = collections.defaultdict(list)
    for row in read(paths):
        key = (float(row["limit"]), float(row["times"]))
        found[key].append((int(row["found"]) > 0, int(row["others"]) > 0))
    print("limit  times  materials  found  others named")
    for (limit, times), each in sorted(found.items()):
        right = "-" if times == 1.0 else f"{100 * sum(r for r, _ in each) / len(each):.0f} %"
        others = 100 * sum(o for _, o in each) / len(each)
        print(f"{limit:5g}  {times:5g}  {len(each):9}  {right:>5}  {others:10.0f} %")


def doubtful(rows):
    """Whether more points help materials of whom little is foreseen."""
    materials = histories(rows)
    for name, chosen in (("foreseen below 30 dB at ten points", lambda e: e < 30.0),
                         ("the others", lambda e: e >= 30.0)):
        true_at = {10: [], 20: [], 40: []}
        for history in materials:
            by_count = {n: (true, expected) for n, true, expected in history}
            if chosen(by_count[10][1]):
                for n in true_at:
                    true_at[n].append(by_count[n][0])
        if true_at[10]:
            means = ", ".join(f"{sum(v) / len(v):.2f} dB at {n}" for n, v in true_at.items())
            print(f"{name}: {len(true_at[10])} materials, {means}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("tables", nargs="+")
    parser.add_argument("--margin", type=float, default=0.5)
    parser.add_argument("--nested", action="store_true", help="margins from the other folds")
    parser.add_argument("--outliers", action="store_true", help="tables of `closed_loop outliers`")
    options = parser.parse_args()
    if options.outliers:
        outliers(options.tables)
        return
    rows = read(options.tables)
    replacement(rows)
    if options.nested:
        nested(rows)
    until(rows, options.margin)
    doubtful(rows)


if __name__ == "__main__":
    main()
