#!/usr/bin/env python3
"""usage: domination.py FOLDER

Is a preset of the library dominated? It is if one other method is as fast and as exact in every scene, with rays of one
length. FOLDER holds the tables that docs/make-performance measured. Exits with 1 if one is.
"""
import collections
import csv
import pathlib
import sys

PRESETS = ("fast", "balanced", "accurate")
OPERATIONS = ("ssao", "dof")


def rows(name):
    with open(pathlib.Path(sys.argv[1]) / f"{name}.csv", newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["operation"] in OPERATIONS and row["kind"] != "floor"]


def place(row):
    """Methods are compared where this is the same: 5 and 40 % of the width are rays of two lengths."""
    long_rays = row["operation"] == "ssao" and float(row["radius_px"]) > 0.1 * float(row["width"])
    return row["operation"], row["storage"], "long rays" if long_rays else "short rays"


times, errors = collections.defaultdict(dict), collections.defaultdict(lambda: collections.defaultdict(dict))
for row in rows("presets"):
    if row["width"] == "1920" and row["ms"]:
        times[place(row)][row["method"]] = float(row["ms"])
for row in rows("errors"):
    if row["rms"]:
        errors[place(row)][row["method"]][row["scene"]] = float(row["rms"])

compared, found = 0, []
for at, methods in errors.items():
    for preset in PRESETS:
        own = methods.get(preset, {})
        for other, its in methods.items():
            if other == preset or not own or at not in times or not {preset, other} <= times[at].keys():
                continue
            compared += 1
            faster = times[at][other] <= times[at][preset]
            if faster and its.keys() >= own.keys() and all(its[scene] <= own[scene] for scene in own):
                found.append(f"{', '.join(at)}: {preset} is dominated by {other}")
print(f"{compared} pairs of a preset and another method compared")
print("\n".join(found) or "no preset is dominated")
sys.exit(1 if found or compared < 30 else 0)
