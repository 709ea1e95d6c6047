#!/usr/bin/env python3
"""Time of `dynid identify` by simulations of the closed loop: a UR10 of 78 parameters, 10 s at 500 Hz.

    ur10.py URDF FOLDER [--runs 5] [--dynid PROGRAM]

Makes a log in closed loop (stated gains, encoder noise of 1e-5 rad, effort noise) and prints per method the least time of some runs, rounds, and by how much
rotors and friction are off at most.
"""

import argparse
import json
import subprocess
import time
from pathlib import Path

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
ROTOR = [3.0, 3.0, 1.5, 0.4, 0.4, 0.3]
COULOMB = [8.0, 9.0, 5.0, 2.0, 1.6, 1.2]
VISCOUS = [12.0, 14.0, 8.0, 2.5, 2.2, 1.5]
GAINS = [[9000, 12000, 5000, 900, 700, 300], [560, 700, 260, 50, 40, 18]]


def robot(urdf):
    text = f'schema = 1\nname = "ur10"\nurdf = "{urdf.resolve()}"\n'
    for name, rotor, coulomb, viscous in zip(JOINTS, ROTOR, COULOMB, VISCOUS, strict=True):
        text += f'[element.{name}_joint]\nelements = ["coulomb", "viscous", "rotor"]\n'
        text += f"coulomb = {{ effort = {coulomb} }}\nviscous = {{ coefficient = {viscous} }}\nrotor = {{ inertia = {rotor} }}\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--dynid", default="dynid")
    args = parser.parse_args()
    folder = args.folder
    folder.mkdir(parents=True, exist_ok=True)

    def run(*words):
        done = subprocess.run([args.dynid, *map(str, words)], cwd=folder, capture_output=True, text=True)
        # A fit that is not to be trusted is a result.
        if done.returncode > 1:
            raise SystemExit(f"dynid {' '.join(map(str, words))}: {done.stderr}")

    (folder / "robot.toml").write_text(robot(args.urdf))
    omega = 2 * 3.141592653589793 / 10
    joints = []
    for k, name in enumerate(JOINTS):
        a = [round(0.5 * (-1) ** (k * l) / (l + 0.5 * k), 4) for l in range(1, 6)]
        b = [round(0.4 * (-1) ** (k + l) / (l + 0.3), 4) for l in range(1, 6)]
        joints.append({"name": f"{name}_joint", "q0": [0.0, -1.2, 1.0, 0.3, 0.5, 0.0][k], "a": a, "b": b})
    motion = {"schema": "dynid-trajectory/1", "form": "plain", "base_frequency_rad_s": omega, "periods": 1, "joints": joints}
    (folder / "motion.json").write_text(json.dumps(motion))
    position, velocity = GAINS
    loop = f"position_gain = {position}\nvelocity_gain = {velocity}\nrate_hz = 500\n"
    (folder / "sim.toml").write_text(
        'mode = "closed_loop"\nfollow = "motion.json"\nrate_hz = 500\neffort_noise = 0.001\nencoder_bits = 0\ndelay_samples = 0\n'
        f"[control]\nfeed_forward = false\n{loop}[imperfections]\nencoder_noise = 1e-5\nripple_share = 0\noutlier_share = 0\ndropped_share = 0\nclock_jitter_s = 0\n"
    )
    run("simulate", "robot.toml", "--config", "sim.toml", "--out", "log.csv", "--truth", "truth.json", "--force")
    truth = json.loads((folder / "truth.json").read_text())
    for method in ["wls", "didim", "cloe"]:
        (folder / "run.toml").write_text(
            f'robot = "robot.toml"\nout = "{method}"\n[[log]]\npath = "log.csv"\n[elements]\nfriction = "given"\n[estimator]\nmethod = "{method}"\n'
            f'[instruments]\ntrajectory = "motion.json"\n{loop}'
        )
        times = []
        for _ in range(args.runs):
            start = time.perf_counter()
            run("identify", "run.toml", "--force")
            times.append(time.perf_counter() - start)
        estimate = json.loads((folder / method / "estimate.json").read_text())
        off = {
            symbol: max(abs(p["value"] / truth[p["name"]] - 1) for p in estimate["parameters"] if p["name"].endswith("." + symbol))
            for symbol in ["Ia", "fc", "fv"]
        }
        text = ", ".join(f"{symbol} off by {100 * x:.2f} %" for symbol, x in off.items())
        print(f"{method}: {min(times):.2f} s, {estimate['verdict']['status']}, {text}")


if __name__ == "__main__":
    main()
