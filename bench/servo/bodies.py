#!/usr/bin/env python3
"""Arms that log positions only and whose robot file has wrong masses, with known truth.

    bodies.py FOLDER [--count 12] [--seed 1] [--dynid PROGRAM] [--error 0.2] [--unknown-gain]

The arms are those of `designs.py` with heavy links; the robot file scales every mass, centre and moment of inertia by factors of its own, log-normal with `--error`.
Of every arm 10 s of random motion are recorded in MuJoCo; `dynid servo` identifies its drives with `bodies = "file"` and `bodies = "found"`, position gain stated unless
`--unknown-gain`. Printed are, for both, the error of drives (geometric mean, and the share of 95 % intervals that hold), the error of the exported MJCF on another motion, moved by MuJoCo
itself, and for bodies that were found the errors of masses and first moments that the file says are told. Needs numpy and mujoco.
"""

import argparse
import json
import math
from pathlib import Path

import mujoco
import numpy as np

from designs import RATE, STEP, Arm, errors, run


class Wrong(Arm):
    """An arm whose robot file has other bodies."""

    def __init__(self, rng, folder, error):
        self.factor = None
        super().__init__(rng, folder)
        self.mass = [3.0 * m for m in self.mass]
        n = self.n
        self.factor = np.exp(rng.normal(0, error, (n, 3)))
        (folder / "arm.xml").write_text(self.mjcf(False))
        self.factor = None
        self.model = mujoco.MjModel.from_xml_string(self.mjcf(True))
        self.stated = mujoco.MjModel.from_xml_path(str(folder / "arm.xml"))

    def mjcf(self, truth):
        text = super().mjcf(truth)
        if self.factor is None:
            return text
        for k in range(self.n):
            m, c, i = self.factor[k]
            inertia = self.mass[k] * self.length[k] ** 2 / 12
            old = (f'<inertial pos="0.02 0.01 {0.5 * self.length[k]:.6g}" mass="{self.mass[k]:.9g}" '
                   f'diaginertia="{inertia:.9g} {inertia:.9g} {0.1 * inertia:.9g}"/>')
            inertia *= m * i
            new = (f'<inertial pos="0.02 0.01 {0.5 * self.length[k] * c:.6g}" mass="{self.mass[k] * m:.9g}" '
                   f'diaginertia="{inertia:.9g} {inertia:.9g} {0.1 * inertia:.9g}"/>')
            assert text.count(old) == 1
            text = text.replace(old, new)
        return text


def moved(folder, names, command, delay):
    """Positions of an exported robot with its actuators along commands."""
    actuators = (folder / "actuators.xml").read_text().replace("<mujoco>", "").replace("</mujoco>", "")
    model = mujoco.MjModel.from_xml_string((folder / "arm.xml").read_text().replace("</mujoco>", f"{actuators}</mujoco>"))
    model.opt.timestep = STEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    place = [model.joint(n).qposadr[0] for n in names]
    order = [next(a for a in range(model.nu) if model.actuator_trnid[a, 0] == model.joint(n).id) for n in names]
    data.qpos[place] = command[0]
    mujoco.mj_forward(model, data)
    per, late = round(1 / RATE / STEP), round(delay / STEP)
    rows = []
    for k in range(len(command) * per):
        if k % per == 0:
            rows.append(data.qpos[place].copy())
        data.ctrl[order] = command[max(0, k - late) // per]
        mujoco.mj_step(model, data)
    return np.array(rows)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="target/release/dynid")
    parser.add_argument("--error", type=float, default=0.2)
    parser.add_argument("--unknown-gain", action="store_true")
    args = parser.parse_args()
    kinds = ["file", "found"]
    drives, holds, rms = ({kind: [] for kind in kinds} for _ in range(3))
    masses, told, every = [], [], []
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        arm = Wrong(rng, args.folder / f"arm{k}", args.error)
        for name in ["log", "other"]:
            command = arm.random(rng, 20.0)
            while (over := arm.record(command, arm.folder / f"{name}.csv")) > 1.02:
                command /= over
        truth = np.loadtxt(arm.folder / "other.csv", delimiter=",", skiprows=1)
        line = []
        for kind in kinds:
            gain = "" if args.unknown_gain else f"position_gain = {arm.gain!r}\ngain_error = 0.01\n"
            (arm.folder / f"{kind}.toml").write_text(
                f'robot = "arm.xml"\n[[log]]\npath = "log.csv"\n[servo]\nvelocity_gain = {arm.velocity_gain}\n{gain}bodies = "{kind}"\n')
            out = arm.folder / kind
            run(args.dynid, "servo", arm.folder / f"{kind}.toml", "--out", out, "--force")
            servo = json.loads((out / "servo.json").read_text())
            own = []
            for p in servo["parameters"]:
                # The drive's damping is stated here.
                p["value"] += arm.velocity_gain if p["term"] == "viscous" else 0.0
                if p["term"] == "viscous" and p["interval"]:
                    p["interval"] = [x + arm.velocity_gain for x in p["interval"]]
            own = errors(arm, servo)
            drives[kind] += [max(abs(e[2]), 1e-6) for e in own]
            holds[kind] += [e[3] for e in own if e[3] is not None]
            delay = next(p["value"] for p in servo["parameters"] if p["term"] == "delay")
            q = moved(out, arm.names, truth[:, 1:1 + arm.n], delay)
            rms[kind].append(float(np.sqrt(np.mean((q - truth[:, 1 + arm.n:]) ** 2))))
            line.append(f"{kind} {1e3 * rms[kind][-1]:.2f} mrad ({servo['status']}, misfit {servo['fit']['misfit']:.2f}, {servo['law']['additions']})")
            for body in servo["bodies"]:
                link = arm.model.body(body["link"])
                m, c = link.mass[0], link.ipos
                true = [m, *(m * c)]
                for x, p in zip(true, body["parameters"]):
                    if p["interval"]:
                        every.append(p["interval"][0] <= x <= p["interval"][1])
                    if p["told"]:
                        told.append(p["interval"][0] <= x <= p["interval"][1])
                        masses.append((abs(p["value"] - x) / m / (1.0 if p["name"] == "m" else 0.1), abs(p["file"] - x) / m / (1.0 if p["name"] == "m" else 0.1)))
        print(f"arm{k} {arm.n} joints:", ", ".join(line), flush=True)
    mean = lambda x: math.exp(np.mean(np.log(x)))
    for kind in kinds:
        print(f"{kind}: drives {mean(drives[kind]):.5f}, intervals hold {100 * np.mean(holds[kind]):.1f} %, exported robot on another motion {1e3 * mean(rms[kind]):.2f} mrad")
    print(f"all intervals of bodies: {len(every)}, {100 * np.mean(every):.1f} % hold")
    if masses:
        print(f"told of bodies: {len(told)}, intervals hold {100 * np.mean(told):.1f} %, rms error over mass (0.1 m for moments) {np.sqrt(np.mean(np.square(masses), axis=0))} (found, file)")


if __name__ == "__main__":
    main()
