#!/usr/bin/env python3
"""Fleets with encoders on both sides of gears: springs that soften and gears that wear, found or not, against the truth.

    springs.py FOLDER [--robot elastic-arm.toml] [--fleets 5] [--seed 1] [--late 0] [--dynid PROGRAM]

Fleets of 40 robots with 20 logs of 10 s each: in four the stiffness of a joint falls by 10 to 30 %, in four backlash grows to 0.3 to 1 mrad, two have faults of
friction. Stiffness differs by 5 % (standard deviation) between robots and by 0.5 % between logs. --late: records of the links are so many samples late.
Printed per fleet: changes of stiffness and of backlash that are found at their joint, and of those that the fleet says it could see; sound robots called changed;
sizes found over sizes put in; dates within a tenth of the time.
"""

import argparse
import gzip
import json
import math
import shutil
import statistics
import subprocess
from pathlib import Path

SETTINGS = """duration_s = 10
rate_hz = 250
[fleet]
robots = 40
logs = 20
between_robots = { fc = 0.2, fv = 0.25, k1 = 0.05 }
between_logs = { fc = 0.04, fv = 0.06, k1 = 0.005 }
stiffness = 4
backlash = 4
faults = 2
"""
YEAR = 365 * 86400.0


def later(log, samples, links):
    """Moves the columns of links down by some rows."""
    with gzip.open(log, "rt") as file:
        head, *rows = [line.rstrip("\n").split(",") for line in file]
    moved = [k for k, name in enumerate(head) if name in links]
    out = [head]
    for n in range(samples, len(rows)):
        row = list(rows[n])
        for k in moved:
            row[k] = rows[n - samples][k]
        out.append(row)
    with gzip.open(log, "wt", compresslevel=1) as file:
        file.writelines(",".join(row) + "\n" for row in out)


def one(args, seed):
    folder = args.folder / str(seed)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    def run(*words):
        done = subprocess.run([args.dynid, *map(str, words)], cwd=folder, capture_output=True, text=True)
        # A fit that is not to be trusted is a result.
        if done.returncode > 1:
            raise SystemExit(f"dynid {' '.join(map(str, words))}: {done.stderr}")

    (folder / "fleet.toml").write_text(SETTINGS)
    robot = args.robot.resolve()
    run("simulate", robot, "--config", "fleet.toml", "--seed", seed, "--out", "made")
    if args.late:
        for log in sorted((folder / "made/logs").iterdir()):
            later(log, args.late, {"q_j1", "q_j2"})
    logs = [word for name in ("r001-001", "r002-001") for word in ("--log", f"made/logs/{name}.csv.gz")]
    run("reduce", robot, *logs, "--out", "type.factors")
    run("reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors")
    run("fleet", "factors", "--out", "fleet")
    truth = json.loads((folder / "made/truth.json").read_text())
    fleet = json.loads((folder / "fleet/fleet.json").read_text())
    robots = {robot["name"]: robot for robot in fleet["robots"]}
    put_in = {change["robot"] for change in truth["changes"]}
    wrong = [name for name, robot in robots.items() if robot["changes"] and name not in put_in]
    tally = {"k1": [0, 0, 0, 0, []], "backlash": [0, 0, 0, 0, []]}
    for change in truth["changes"]:
        joint, symbol = change["parameter"].rsplit(".", 1)
        if symbol not in tally:
            continue
        robot = robots[change["robot"]]
        parameter = f"{joint}.{'compliance' if symbol == 'k1' else symbol}"
        size = change["size"]
        if symbol == "k1":
            of_robot = [log for log in truth["logs"] if log["robot"] == change["robot"]]
            before = statistics.median(log["parameters"][f"{joint}.k1"] for log in of_robot if log["start_s"] < change["date_s"])
            size = 1 / (before + size) - 1 / before
        else:
            last = robot["dates_s"][1]
            end = 1767225600.0 + YEAR
            size *= (last - change["date_s"]) / (end - change["date_s"])
        own = next(p for p in robot["parameters"] if p["name"] == parameter)
        found = next((c for c in robot["changes"] if c["parameter"] == parameter), None)
        row = tally[symbol]
        row[0] += 1
        row[1] += own.get("detectable", math.inf) < abs(size)
        if found:
            row[2] += 1
            row[3] += abs(found["date"]["at_s"] - change["date_s"]) < 0.1 * YEAR
            row[4].append(found["size"] / size)
    for symbol, (count, visible, right, dated, ratios) in tally.items():
        print(f"seed {seed}, {symbol}: {right} of {count} found, {visible} could be seen, {dated} dated, sizes " + " ".join(f"{r:.2f}" for r in ratios))
    print(f"seed {seed}: {len(wrong)} sound robots changed {wrong}, {len(fleet['logs_to_look_at'])} logs to look at")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robot", type=Path, default=Path(__file__).parent / "elastic-arm.toml")
    parser.add_argument("--fleets", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--late", type=int, default=0)
    parser.add_argument("--dynid", default="dynid")
    args = parser.parse_args()
    for seed in range(args.seed, args.seed + args.fleets):
        one(args, seed)


if __name__ == "__main__":
    main()
