#!/usr/bin/env python3
"""usage: domination.py FOLDER EXPECTED

Is each preset of the library on the front of error and time, in every scene and with every radius that FOLDER's tables, which
docs/make-performance measured, have times for? And does the error fall from preset to preset?
  beaten  another method takes no longer at the same size and radius, and its error is smaller by more than a tie, for 95 % of
          the paired bootstraps of the sample points, too
  rises   the preset's error is larger than that of the faster preset before it, by more than a tie, for 95 % likewise
An error is the rms of all but the worst 2 % of the points. EXPECTED lists what is known to fail, a line each. Exits with 1
where something else fails, and where something that is listed does not.
"""
import collections
import csv
import pathlib
import sys

PRESETS = ("fast", "balanced", "accurate")
TIE = 0.03


def rows(name):
    with open(pathlib.Path(sys.argv[1]) / f"{name}.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def place(row):
    return row["operation"], row["storage"], row["width"], row["radius_px"]


times = collections.defaultdict(dict)
for row in rows("presets"):
    if row["ms"] and row["kind"] != "floor":
        times[place(row)][row["method"]] = float(row["ms"])

found, places, compared = set(), set(), 0
for row in rows("pairs"):
    known, preset, other = times[place(row)], row["method"], row["other"]
    if preset not in known or other not in known:
        continue
    at = f"{row['operation']} {preset}, {row['scene']}, {row['radius_px']} px"
    places.add(at)
    compared += 1
    is_better = float(row["ratio"]) < 1 - TIE and float(row["most"]) < 1
    if is_better and known[other] <= known[preset]:
        found.add(f"{at}: beaten")
        print(f"{at}: {other} has {float(row['ratio']):.2f} of its error in {known[other] / known[preset]:.2f} of its time")
    if is_better and preset in PRESETS[1:] and other == PRESETS[PRESETS.index(preset) - 1]:
        found.add(f"{at}: rises")
        print(f"{at}: its error is {1 / float(row['ratio']):.2f} of that of {other}")

lines = (line.strip() for line in open(sys.argv[2], encoding="utf-8"))
expected = {line for line in lines if line and not line.startswith("#")}
print(f"{len(places)} places of a preset, {compared} pairs; {len(found)} failures, {len(expected)} expected")
for what, failures in (("not expected", found - expected), ("expected, and does not fail: remove it from the list", expected - found)):
    for failure in sorted(failures):
        print(f"{failure}: {what}")
sys.exit(1 if found != expected or len(places) < 84 else 0)
