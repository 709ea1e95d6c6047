"""Table of times and ratios from the files that `bench/run` leaves in a folder."""

import statistics
import sys
from pathlib import Path


def read(path):
    rows = (line.split() for line in path.read_text().splitlines())
    return {(robot, function, way): float(ns) for robot, function, way, ns in rows}


def main(folder):
    ours, theirs = ([read(p) for p in sorted(folder.glob(f"round-*-{side}"))] for side in ("dynid", "pinocchio"))
    print("| robot | function | way | dynid, ns | Pinocchio, ns | ratio of least times | median ratio of rounds |")
    print("|---|---|---|---|---|---|---|")
    for robot, function, way in ours[0]:
        us = [r[robot, function, way] for r in ours]
        them = [r[robot, function, "plain"] for r in theirs]
        least = min(us) / min(them)
        median = statistics.median(u / t for u, t in zip(us, them))
        name = function.replace("_", " ")
        print(f"| {robot} | {name} | {way} | {min(us):.0f} | {min(them):.0f} | {least:.3f} | {median:.3f} |")


main(Path(sys.argv[1]))
