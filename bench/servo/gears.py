#!/usr/bin/env python3
"""Arms whose gears give way, that log positions of their motors only, with known truth.

    gears.py FOLDER [--count 12] [--seed 1] [--dynid PROGRAM] [--backlash 0.0]

The arms are those of `designs.py` with heavy links, each of which swings on its gear at 5 to 20 Hz while its motor stands; with `--backlash` gears have so much of it (rad, about). MuJoCo moves them: a gear is a
joint of its own behind that of its motor. Of every arm 10 s of random motion are recorded, from rest; `dynid servo` identifies it with stiff gears, and with gears that are
found. Printed are, for both, the residual over the encoders' rounding, the error of drives (geometric mean), the share of 95 % intervals that hold, and the error of the exported MJCF on another motion, moved by
MuJoCo itself; and for gears the error of compliance, damping and backlash. Needs numpy and mujoco.
"""

import argparse
import json
import math
from pathlib import Path

import mujoco
import numpy as np

from designs import RATE, STEP, Arm, errors, run

REST = 2.0  # s at the first command before a log begins


class Soft(Arm):
    """An arm with gears that give way."""

    def __init__(self, rng, folder, backlash):
        self.stiffness = None
        super().__init__(rng, folder)
        self.mass = [3.0 * m for m in self.mass]
        (folder / "arm.xml").write_text(self.mjcf(False))
        model = mujoco.MjModel.from_xml_string(super().mjcf(False))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        inertia = np.zeros(self.n)
        for k in range(self.n):
            column = np.zeros(self.n)
            mujoco.mj_mulM(model, data, column, np.eye(self.n)[k])
            inertia[k] = column[k]
        self.stiffness = inertia * (2 * math.pi * np.exp(rng.uniform(math.log(5.0), math.log(20.0), self.n))) ** 2
        self.damping = 2 * np.exp(rng.uniform(math.log(0.03), math.log(0.2), self.n)) * np.sqrt(inertia * self.stiffness)
        self.backlash = backlash * np.exp(rng.uniform(-0.4, 0.4, self.n))
        self.model = mujoco.MjModel.from_xml_string(self.mjcf(True))

    def mjcf(self, truth):
        text = super().mjcf(truth)
        if self.stiffness is None or not truth:
            return text
        for k, name in enumerate(self.names):
            start = text.index(f'<joint name="{name}"')
            end = text.index("/>", start) + 2
            text = f'{text[:end]}<joint name="{name}_spring" axis="{self.axis[k]}"/>{text[end:]}'
        return text

    def carry(self, _, data):
        """What gears carry, in each stage of a step."""
        lead, rate = -data.qpos[1::2], -data.qvel[1::2]
        half = 0.5 * self.backlash
        twist = np.where(lead >= half, lead - half, np.where(lead <= -half, lead + half, 0.0))
        data.qfrc_passive[1::2] += np.where(np.abs(lead) >= half, self.stiffness * twist + self.damping * rate, 0.0)

    def record(self, command, path):
        mujoco.set_mjcb_passive(self.carry)
        try:
            rows, speed, reach = played(self.model, lambda d: d.qpos[::2], lambda d, u: d.ctrl.__setitem__(slice(None), u), command, self.delay)
        finally:
            mujoco.set_mjcb_passive(None)
        turn = 2 * math.pi / 4096
        head = ",".join(["t"] + [f"cmd_{n}" for n in self.names] + [f"q_{n}" for n in self.names])
        table = np.column_stack([np.arange(len(command)) / RATE, command, np.round(rows / turn) * turn])
        np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.12g")
        return max(speed / 4.0, (np.abs(rows) / self.range[:, 1]).max())


def played(model, read, tell, command, delay):
    """Positions of motors along commands, from rest at the first."""
    data = mujoco.MjData(model)
    read(data)[:] = command[0]
    per, late = round(1 / RATE / STEP), round(delay / STEP)
    tell(data, command[0])
    for _ in range(round(REST / STEP)):
        mujoco.mj_step(model, data)
    rows, speed = [], 0.0
    for k in range(len(command) * per):
        if k % per == 0:
            rows.append(np.array(read(data)))
            speed = max(speed, np.abs(data.qvel).max())
        tell(data, command[max(0, k - late) // per])
        mujoco.mj_step(model, data)
    return np.array(rows), speed, 0.0


def moved(folder, names, command, delay):
    """Positions of an exported robot with its actuators along commands."""
    actuators = (folder / "actuators.xml").read_text().replace("<mujoco>", "").replace("</mujoco>", "")
    model = mujoco.MjModel.from_xml_string((folder / "arm.xml").read_text().replace("</mujoco>", f"{actuators}</mujoco>"))
    model.opt.timestep = STEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for name in names:  # limits of motors are no part of the truth; those of gears are flanks
        model.jnt_limited[model.joint(name).id] = 0
    place = [model.joint(n).qposadr[0] for n in names]
    order = [next(a for a in range(model.nu) if model.actuator_trnid[a, 0] == model.joint(n).id) for n in names]

    class View:
        def __init__(self, data):
            self.data = data

        def __setitem__(self, _, q):
            self.data.qpos[place] = q

        def __array__(self, dtype=None, copy=None):
            return self.data.qpos[place].copy()

    return played(model, View, lambda d, u: d.ctrl.__setitem__(order, u), command, delay)[0]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="target/release/dynid")
    parser.add_argument("--backlash", type=float, default=0.0)
    args = parser.parse_args()
    kinds = ["stiff", "found"]
    drives, holds, rms, misfit = ({kind: [] for kind in kinds} for _ in range(4))
    gears, joints = {}, 0
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        arm = Soft(rng, args.folder / f"arm{k}", args.backlash)
        for name in ["log", "other"]:
            command = arm.random(rng, 20.0)
            while (over := arm.record(command, arm.folder / f"{name}.csv")) > 1.02:
                command /= over
        truth = np.loadtxt(arm.folder / "other.csv", delimiter=",", skiprows=1)
        joints += arm.n
        line = []
        for kind in kinds:
            asked = ["compliance", "gear_damping"] + (["backlash"] if args.backlash else [])
            find = f"find = {json.dumps(asked)}\n" if kind == "found" else ""
            (arm.folder / f"{kind}.toml").write_text(f'robot = "arm.xml"\n[[log]]\npath = "log.csv"\n[servo]\n{find}')
            out = arm.folder / kind
            run(args.dynid, "servo", arm.folder / f"{kind}.toml", "--out", out, "--force")
            servo = json.loads((out / "servo.json").read_text())
            own = errors(arm, servo)
            drives[kind] += [max(abs(e[2]), 1e-6) for e in own]
            holds[kind] += [e[3] for e in own if e[3] is not None]
            misfit[kind].append(servo["fit"]["misfit"])
            delay = next(p["value"] for p in servo["parameters"] if p["term"] == "delay")
            q = moved(out, arm.names, truth[:, 1:1 + arm.n], delay)
            rms[kind].append(float(np.sqrt(np.mean((q - truth[:, 1 + arm.n:]) ** 2))))
            line.append(f"{kind} {1e3 * rms[kind][-1]:.2f} mrad ({servo['status']}, misfit {misfit[kind][-1]:.2f}, {servo['law']['additions']})")
            for p in servo["parameters"]:
                true = {"compliance": 1 / arm.stiffness, "gear_damping": arm.damping, "backlash": arm.backlash}.get(p["term"])
                if true is not None:
                    true = true[arm.names.index(p["joints"][0])]
                    inside = None if p["interval"] is None else p["interval"][0] <= true <= p["interval"][1]
                    gears.setdefault(p["term"], []).append((p["value"] / true - 1, inside, p["verdict"]))
        print(f"arm{k} {arm.n} joints:", ", ".join(line), flush=True)
    mean = lambda x: math.exp(np.mean(np.log(x)))
    for kind in kinds:
        print(f"{kind}: misfit {np.median(misfit[kind]):.2f}, drives {mean(drives[kind]):.5f}, intervals hold {100 * np.mean(holds[kind]):.1f} %, "
              f"exported robot on another motion {1e3 * mean(rms[kind]):.2f} mrad")
    for term, of in gears.items():
        told = [e for e in of if e[2] == "seen"]
        inside = [e[1] for e in of if e[1] is not None]
        print(f"{term}: {len(of)} of {joints} found, median error {100 * np.median([abs(e[0]) for e in of]):.2f} %, {len(told)} seen "
              f"(median {100 * np.median([abs(e[0]) for e in told] or [math.nan]):.2f} %), intervals hold {100 * np.mean(inside):.1f} %")


if __name__ == "__main__":
    main()
