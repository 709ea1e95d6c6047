#!/usr/bin/env python3
"""Models that a fleet gives, against the truth: bodies of the type, and parameters that have changed.

    models.py ROBOT.urdf FOLDER [--wrong WRONG.urdf] [--fleets 8] [--seed 11] [--dynid PROGRAM]

Fleets of 24 robots with 12 logs of 10 s each are made of ROBOT.urdf, reduced with a robot file whose bodies are wrong (WRONG.urdf, or every
mass, centre and inertia of ROBOT.urdf scaled at random by up to a third), and fitted. Printed per fleet: relative error of the efforts of the bodies
on random states, of the type, of 24 logs solved as if they were of one robot, and of one log; and by how many standard deviations every
parameter that was changed lies from its truth at the last log, and how many of the 95 % intervals of the bodies of the type hold. Needs numpy and
Pinocchio.
"""

import argparse
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pinocchio

SETTINGS = "duration_s = 10\nrate_hz = 100\n[fleet]\nrobots = 24\nlogs = 12\noutliers = 1\nwear = 2\nfaults = 1\n"
FIRST_DAY, YEAR = 1_767_225_600.0, 365 * 86_400.0
PER_KELVIN = {"fv": -0.01}  # the program's default, of the nominal value


def bent(text, rng):
    """A robot file whose bodies are others: mass and inertia of a link by one factor, its centre by another."""

    def scaled(match):
        factor, shift = rng.uniform(0.75, 1.33), rng.uniform(0.75, 1.33)
        own = re.sub(r'((?:value|ixx|ixy|ixz|iyy|iyz|izz)=")([^"]+)', lambda m: m[1] + repr(factor * float(m[2])), match[0])
        return re.sub(r'(<origin[^>]*xyz=")([^"]+)', lambda m: m[1] + " ".join(repr(shift * float(x)) for x in m[2].split()), own)

    return re.sub(r"<inertial>.*?</inertial>", scaled, text, flags=re.S)


def efforts(path, states):
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    return np.array([pinocchio.rnea(model, data, *state) for state in states])


def held(path, model):
    """Of the intervals of bodies in an estimate, how many hold, and their number."""
    names = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"]
    frames, hold = {frame.name: frame.parentJoint for frame in model.frames}, []
    for p in json.loads(path.read_text())["parameters"]:
        if p.get("link") and p["interval"] and frames.get(p["link"]):
            truth = model.inertias[frames[p["link"]]].toDynamicParameters()[names.index(p["name"].rsplit(".")[-1])]
            low, high = p["interval"]
            hold.append(low <= truth <= high)
    return sum(hold), len(hold)


def changed(folder):
    """Deviations of parameters that were changed from their truth at the last log, over their standard deviations."""
    truth = json.loads((folder / "made/truth.json").read_text())
    logs, mean = truth["logs"], np.mean([log["temperature"] for log in truth["logs"]])
    out = []
    for change in truth["changes"]:
        file, name = folder / f"fleet/robots/{change['robot']}.json", change["parameter"]
        if not file.exists():
            out.append(None)
            continue
        own = sorted((log for log in logs if log["robot"] == change["robot"]), key=lambda log: log["start_s"])
        time = np.array([log["start_s"] for log in own])
        slope = PER_KELVIN.get(name.rsplit(".")[-1], 0.0) * truth["type"][name]
        values = np.array([log["parameters"][name] - slope * (log["temperature"] - mean) for log in own])
        end = FIRST_DAY + YEAR
        ramp = np.maximum(0.0, (time - change["date_s"]) / (end - change["date_s"]))
        shape = (time >= change["date_s"]).astype(float) if change["kind"] == "step" else ramp
        now = np.mean(values - change["size"] * shape) + change["size"] * shape[-1]
        found = next(p for p in json.loads(file.read_text())["parameters"] if p["name"] == name)
        out.append((found["unconstrained"] - now) / found["std"])
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--wrong", type=Path)
    parser.add_argument("--fleets", type=int, default=8)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--dynid", default="dynid")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    model = pinocchio.buildModelFromUrdf(str(args.robot))
    states = [tuple(rng.uniform(-s, s, model.nv) for s in (3.0, 2.0, 5.0)) for _ in range(300)]
    truth = efforts(args.robot, states)
    error = lambda path: np.linalg.norm(efforts(path, states) - truth) / np.linalg.norm(truth)
    errors, deviations, bodies = [], [], np.zeros(2, int)
    for k in range(args.fleets):
        folder = args.folder / f"fleet{k:02}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "fleet.toml").write_text(SETTINGS)
        wrong = args.wrong or folder / "wrong.urdf"
        if not args.wrong:
            wrong.write_text(bent(args.robot.read_text(), rng))

        def run(*words, folder=folder):
            ended = subprocess.run([args.dynid, *map(str, words), "--quiet", "--force"], cwd=folder, capture_output=True, text=True, check=False)
            assert ended.returncode == 0 or words[0] in ("identify", "solve", "reduce"), ended.stderr

        robot, wrong = args.robot.resolve(), wrong.resolve()
        log = lambda r, l: ["--log", f"made/logs/r{r:03}-{l:03}.csv.gz"]
        some = [word for r in range(1, 9) for l in (1, 5, 9) for word in log(r, l)]
        subprocess.run([args.dynid, "simulate", robot, "--config", "fleet.toml", "--seed", str(args.seed + k), "--out", "made", "--quiet"], cwd=folder, check=True)
        run("reduce", wrong, *log(1, 1), *log(2, 1), *log(3, 3), "--out", "type.factors")
        subprocess.run([args.dynid, "reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--quiet"], cwd=folder, check=True, capture_output=True)
        run("fleet", "factors", "--out", "fleet")
        run("reduce", "type.factors", *some, "--out", "some.factors")
        run("solve", "some.factors", "--out", "solved")
        run("identify", wrong, *log(1, 1), "--out", "one")
        files = []
        for estimate in ("fleet/type.json", "solved/estimate.json", "one/estimate.json"):
            files.append(folder / (estimate.split("/")[0] + ".urdf"))
            run("export", estimate, "--urdf", files[-1].name)
        errors.append([error(file) for file in files])
        deviations += changed(folder)
        bodies += held(folder / "fleet/type.json", model)
        print(f"{k}: robot file {error(wrong):.3f}, type {errors[-1][0]:.5f}, 24 logs {errors[-1][1]:.5f}, one log {errors[-1][2]:.5f};", deviations[-3:])
    told = [z for z in deviations if z is not None]
    print("median of the errors:", np.round(np.median(errors, axis=0), 5))
    print(f"intervals of the bodies of the type: {bodies[0]} of {bodies[1]} hold")
    print(f"changed: {len(told)} of {len(deviations)} told, rms {np.sqrt(np.mean(np.square(told))):.2f} deviations, {sum(abs(z) < 1.96 for z in told)} within the 95 % interval")


if __name__ == "__main__":
    main()
