#!/usr/bin/env python3
"""Fleets whose robots carry what nobody stated: changes that are found, logs that stand out, and masses against the truth.

    payloads.py ROBOT FOLDER [--link link6] [--most 3.0] [--fleets 5] [--seed 1] [--teach bare|any] [--dynid PROGRAM]

Fleets of 20 robots with 16 logs of 6 s each, half of which carry up to --most kg on the last link; two robots with wear, two with faults, one that stands
out. Each is reduced by a recipe that knows of no payload and by one learned with `--payload LINK`, both taught by the first two logs of the first robot that
carry nothing (`any`: by its first two logs). Printed per fleet and recipe: changes found at their parameter, sound robots called changed, logs to look at;
and of the masses the root mean square error and standard deviation, g, and the share of 95 % intervals that hold.
"""

import argparse
import json
import math
import shutil
import subprocess
from pathlib import Path

SETTINGS = "duration_s = 6\nrate_hz = 100\n[fleet]\nrobots = 20\nlogs = 16\noutliers = 1\nwear = 2\nfaults = 2\npayload = {most}\n"


def masses(fleet, carried):
    """Root mean square error and deviation of what logs carried, kg, and the share of intervals that hold."""
    found = [(carried[Path(log["log"]).name.split(".")[0]], log["difference"][0], log["sd"][0]) for log in fleet["payload"]["logs"]]
    mean = sum(truth for truth, _, _ in found) / len(found)
    errors = [(value - (truth - mean), sd) for truth, value, sd in found]
    rms = [math.sqrt(sum(x * x for x in xs) / len(xs)) for xs in zip(*errors, strict=True)]
    return rms[0], rms[1], sum(abs(error) < 1.96 * sd for error, sd in errors) / len(errors)


def one(args, seed):
    folder = args.folder / str(seed)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    def run(*words):
        done = subprocess.run([args.dynid, *map(str, words)], cwd=folder, capture_output=True, text=True)
        # A fit that is not to be trusted is a result.
        if done.returncode > 1:
            raise SystemExit(f"dynid {' '.join(map(str, words))}: {done.stderr}")

    (folder / "fleet.toml").write_text(SETTINGS.format(most=args.most))
    run("simulate", args.robot, "--config", "fleet.toml", "--seed", seed, "--out", "made")
    truth = json.loads((folder / "made/truth.json").read_text())
    carried = {log["file"].split(".")[0]: log.get("payload", 0.0) for log in truth["logs"]}
    of_first = [log["file"] for log in truth["logs"] if log["robot"] == truth["logs"][0]["robot"]]
    taught = [log for log in of_first if args.teach == "any" or not carried[log.split(".")[0]]][:2]
    changes = {change["robot"]: change["parameter"] for change in truth["changes"]}
    for name, flags in [("without", []), ("with", ["--payload", args.link])]:
        logs = [word for log in taught for word in ("--log", f"made/logs/{log}")]
        run("reduce", args.robot, *logs, *flags, "--out", f"{name}.factors")
        run("reduce", f"{name}.factors", "--manifest", "made/manifest.csv", "--out", name)
        run("fleet", name, "--out", f"{name}-fleet")
        fleet = json.loads((folder / f"{name}-fleet/fleet.json").read_text())
        told = {robot["name"]: robot["changes"][0]["parameter"] for robot in fleet["robots"] if robot["changes"]}
        right = sum(told.get(robot) == parameter for robot, parameter in changes.items())
        wrong = sum(robot not in changes for robot in told)
        text = f"seed {seed}, {name}: {right} of {len(changes)} changes, {wrong} sound robots changed, {len(fleet['logs_to_look_at'])} logs to look at"
        if fleet.get("payload"):
            error, sd, hold = masses(fleet, carried)
            text += f"; masses {1e3 * error:.1f} g, stated {1e3 * sd:.1f} g, {100 * hold:.1f} % hold"
        print(text, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", type=lambda path: Path(path).resolve())
    parser.add_argument("folder", type=Path)
    parser.add_argument("--link", default="link6")
    parser.add_argument("--most", type=float, default=3.0)
    parser.add_argument("--fleets", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--teach", choices=["bare", "any"], default="bare")
    parser.add_argument("--dynid", type=lambda path: str(Path(path).resolve()), default="target/release/dynid")
    args = parser.parse_args()
    for seed in range(args.seed, args.seed + args.fleets):
        one(args, seed)


if __name__ == "__main__":
    main()
