#!/usr/bin/env python3
"""Drives whose efforts or currents are measured beside positions, on simulated arms with known truth.

    efforts.py FOLDER [--count 20] [--seed 1] [--dynid PROGRAM] [--noise 0.05] [--light 0.02]

Arms are those of designs.py: MuJoCo moves them. Their bodies are made lighter by a factor, so that positions tell ratios and little of the scale. Of every
arm three logs of 10 s of random motion are recorded: with efforts (N m, as they act at the instant of the encoder's reading, noise as a share of the largest),
with currents (A, torque constants that nobody states), and with positions alone. Identified from them: positions alone, with efforts, with currents, and all
three logs at once, with efforts in one of them and currents in another. Printed are the geometric means of relative errors by parameter, the share of 95 % intervals
that hold, and the ratio of errors. Needs numpy and mujoco.
"""

import argparse
import json
import math
from pathlib import Path

import mujoco
import numpy as np

from designs import RATE, STEP, Arm, run

TERMS = ["position_gain", "velocity_gain", "rotor_inertia", "viscous", "coulomb", "delay", "torque_constant"]


class Measured(Arm):
    def __init__(self, rng, folder, light):
        super().__init__(rng, folder)
        self.mass = [light * m for m in self.mass]
        self.constant = float(2.0 * math.exp(rng.uniform(-0.5, 0.5)))
        (folder / "arm.xml").write_text(self.mjcf(False))
        self.model = mujoco.MjModel.from_xml_string(self.mjcf(True))

    def value(self, term, joint):
        own = {"velocity_gain": self.velocity_gain, "viscous": self.viscous[joint], "torque_constant": self.constant}
        return own[term] if term in own else self.truth(term, joint)

    def measure(self, rng, command, path, channel, noise):
        """Records a log with a channel of efforts; returns how far the arm goes beyond its limits."""
        over = self.record(command, path)
        if channel is None or over > 1.02:
            return over
        data = mujoco.MjData(self.model)
        data.qpos[:] = command[0]
        mujoco.mj_forward(self.model, data)
        per, late = round(1 / RATE / STEP), round(self.delay / STEP)
        rows = []
        for k in range(len(command) * per):
            data.ctrl[:] = command[max(0, k - late) // per]
            if k % per == 0:
                mujoco.mj_forward(self.model, data)
                rows.append(data.qfrc_actuator.copy())
            mujoco.mj_step(self.model, data)
        rows = np.array(rows) / (self.constant if channel == "current" else 1.0)
        rows += noise * np.abs(rows).max(axis=0) * rng.normal(size=rows.shape)
        log = np.loadtxt(path, delimiter=",", skiprows=1)
        word = "i" if channel == "current" else "tau"
        head = path.read_text().splitlines()[0] + "".join(f",{word}_{n}" for n in self.names)
        np.savetxt(path, np.column_stack([log, rows]), delimiter=",", header=head, comments="", fmt="%.12g")
        return over


def identify(program, arm, logs, out, fit):
    text = 'robot = "arm.xml"\n' + "".join(f'[[log]]\npath = "{log.name}"\n' for log in logs)
    config = arm.folder / f"{out}.toml"
    config.write_text(text + f"[servo]\nfit = {json.dumps(fit)}\n")
    run(program, "servo", config, "--out", arm.folder / out, "--force")
    return json.loads((arm.folder / out / "servo.json").read_text())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="target/release/dynid")
    parser.add_argument("--noise", type=float, default=0.02)
    parser.add_argument("--light", type=float, default=0.05)
    args = parser.parse_args()
    kinds = ["positions", "efforts", "currents", "all"]
    sizes = {kind: {} for kind in kinds}
    holds = {kind: {} for kind in kinds}
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        arm = Measured(rng, args.folder / f"arm{k}", args.light)
        logs = {}
        for name, channel in [("efforts", "effort"), ("currents", "current"), ("positions", None)]:
            logs[name] = arm.folder / f"log_{name}.csv"
            command = arm.random(rng, 20.0)
            while (over := arm.measure(rng, command, logs[name], channel, args.noise)) > 1.02:
                command /= over
        results = {
            "positions": identify(args.dynid, arm, [logs["efforts"]], "positions", []),
            "efforts": identify(args.dynid, arm, [logs["efforts"]], "efforts", ["effort"]),
            "currents": identify(args.dynid, arm, [logs["currents"]], "currents", ["current"]),
            "all": identify(args.dynid, arm, list(logs.values()), "all", ["effort", "current"]),
        }
        line = []
        for kind, result in results.items():
            own = []
            for p in result["parameters"]:
                if p["term"] not in TERMS:
                    continue
                truth = arm.value(p["term"], arm.names.index(p["joints"][0]))
                if kind == "positions" and p["term"] == "viscous":
                    truth += arm.velocity_gain
                own.append(abs(p["value"] / truth - 1.0))
                sizes[kind].setdefault(p["term"], []).append(own[-1])
                if p["interval"] is not None:
                    holds[kind].setdefault(p["term"], []).append(p["interval"][0] <= truth <= p["interval"][1])
            said = {e["verdict"] for e in result["fit"]["efforts"]}
            line.append(f"{kind} {math.exp(np.mean(np.log(np.maximum(own, 1e-6)))):.4f} ({result['status']}, {result['fit']['misfit']:.2f}{''.join(', ' + s for s in said)})")
        print(f"arm{k} {arm.n} joints:", ", ".join(line), flush=True)
    mean = lambda x: math.exp(np.mean(np.log(np.maximum(x, 1e-6)))) if x else math.nan
    share = lambda x: 100 * np.mean(x) if x else math.nan
    for term in TERMS:
        print(f"{term:16}", ", ".join(f"{kind} {mean(sizes[kind].get(term, [])):.5f} ({share(holds[kind].get(term, [])):.0f} %)" for kind in kinds))
    for kind in kinds:
        print(f"{kind}: all {mean(sum(sizes[kind].values(), [])):.5f}, intervals hold {share(sum(holds[kind].values(), [])):.1f} %")


if __name__ == "__main__":
    main()
