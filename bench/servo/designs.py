#!/usr/bin/env python3
"""Motions designed for drives that log positions only, on simulated arms with known truth.

    designs.py FOLDER [--count 20] [--seed 1] [--dynid PROGRAM] [--acceleration 20]

Arms have 3 to 5 joints behind position loops whose gain, rotor inertia, friction and delay nobody states. MuJoCo moves them (Runge-Kutta steps of 0.1 ms, its own
dry friction), encoders have 4096 steps a turn, commands come at 100 Hz. Of every arm a first log is recorded, slow sines as one would write
by hand; `dynid servo` identifies it, `dynid design --drives` takes what was found, and 10 s of the designed motion are recorded and identified.
Beside it: 10 s of random motion with the same harmonics that goes to the same limits, of the command and of the arm. Printed are the geometric means of the
relative errors, by parameter, the share of 95 % intervals that hold, and errors of designed motions over their forecast standard deviation (rms, 1 if the
forecast is right). Needs numpy and mujoco.
"""

import argparse
import json
import math
import subprocess
from pathlib import Path

import mujoco
import numpy as np

RATE = 100.0
STEP = 1e-4
SECONDS = 10.0
SPEED = 4.0
TERMS = ["position_gain", "rotor_inertia", "viscous", "coulomb", "delay"]


class Arm:
    """An arm with its truth."""

    def __init__(self, rng, folder):
        self.n = int(rng.integers(3, 6))
        self.names = [f"j{k + 1}" for k in range(self.n)]
        self.gain = 20.0 * math.exp(rng.uniform(-0.5, 0.5))
        self.velocity_gain = 0.5
        share = math.exp(rng.uniform(-1.5, 0.0))  # bodies beside rotors
        self.mass = [share * m for m in 0.8 * 0.7 ** np.arange(self.n) * np.exp(rng.uniform(-0.3, 0.3, self.n))]
        self.length = 0.25 * np.exp(rng.uniform(-0.3, 0.3, self.n))
        self.rotor = 0.02 * np.exp(rng.uniform(-0.5, 0.5, self.n))
        self.viscous = 0.4 * np.exp(rng.uniform(-0.5, 0.5, self.n))
        self.coulomb = 0.25 * np.exp(rng.uniform(-0.5, 0.5, self.n))
        self.delay = round(rng.uniform(0.005, 0.025) / STEP) * STEP
        self.axis = ["0 0 1"] + ["0 1 0" if rng.random() < 0.7 else "1 0 0" for _ in range(self.n - 1)]
        self.range = np.array([[-w, w] for w in rng.uniform(1.0, 2.0, self.n)])
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "arm.xml").write_text(self.mjcf(False))
        self.model = mujoco.MjModel.from_xml_string(self.mjcf(True))

    def mjcf(self, truth):
        out = [f'<mujoco model="arm"><compiler angle="radian"/><option timestep="{STEP}" integrator="RK4">',
               '<flag contact="disable"/></option><worldbody><body name="base" pos="0 0 0">']
        for k, name in enumerate(self.names):
            own = ""
            if truth:
                own = f'armature="{self.rotor[k]:.9g}" damping="{self.viscous[k]:.9g}" frictionloss="{self.coulomb[k]:.9g}" solreffriction="{4 * STEP} 1" solimpfriction="0.9999 0.9999 0.001"'
            z = 0.1 if k == 0 else self.length[k - 1]
            length = self.length[k]
            inertia = self.mass[k] * length**2 / 12
            out.append(
                f'<body name="l{k + 1}" pos="0 0 {z:.6g}"><joint name="{name}" axis="{self.axis[k]}" range="{self.range[k][0]:.6g} {self.range[k][1]:.6g}" {own}/>'
                f'<inertial pos="0.02 0.01 {0.5 * length:.6g}" mass="{self.mass[k]:.9g}" diaginertia="{inertia:.9g} {inertia:.9g} {0.1 * inertia:.9g}"/>')
        out.append("</body>" * (self.n + 1) + "</worldbody>")
        if truth:
            drives = "".join(f'<general joint="{n}" biastype="affine" gainprm="{self.gain}" biasprm="0 -{self.gain} -{self.velocity_gain}"/>' for n in self.names)
            out.append(f"<actuator>{drives}</actuator>")
        return "".join(out) + "</mujoco>"

    def truth(self, term, joint):
        # Nobody parts the drive's damping from viscous friction.
        return {"position_gain": self.gain, "rotor_inertia": self.rotor[joint], "viscous": self.viscous[joint] + self.velocity_gain,
                "coulomb": self.coulomb[joint], "delay": self.delay}[term]

    def record(self, command, path):
        """Commands, a row per tick, as a log; returns how far the arm goes beyond its speed and its range, at most, as a ratio."""
        self.speed = 0.0
        self.reach = 0.0
        data = mujoco.MjData(self.model)
        data.qpos[:] = command[0]
        mujoco.mj_forward(self.model, data)
        per = round(1 / RATE / STEP)
        late = round(self.delay / STEP)
        turn = 2 * math.pi / 4096
        rows = []
        for k in range(len(command) * per):
            if k % per == 0:
                rows.append(np.round(data.qpos / turn) * turn)
                self.speed = max(self.speed, np.abs(data.qvel).max())
                self.reach = max(self.reach, (np.abs(data.qpos) / self.range[:, 1]).max())
            data.ctrl[:] = command[max(0, k - late) // per]
            mujoco.mj_step(self.model, data)
        head = ",".join(["t"] + [f"cmd_{n}" for n in self.names] + [f"q_{n}" for n in self.names])
        table = np.column_stack([np.arange(len(command)) / RATE, command, rows])
        np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.12g")
        return max(self.speed / SPEED, self.reach)

    def slow(self, rng):
        """What one would write by hand."""
        t = np.arange(int(SECONDS * RATE)) / RATE
        sines = lambda: sum(rng.uniform(0.1, 0.35) * np.sin(2 * math.pi * f * t + rng.uniform(0, 6.28)) for f in rng.uniform(0.1, 0.8, 3))
        return np.column_stack([0.8 * self.range[k][1] * sines() for k in range(self.n)])

    def random(self, rng, acceleration, harmonics=20):
        """Random motion up to the limits."""
        t = np.arange(int(SECONDS * RATE)) / RATE
        w = 2 * math.pi / SECONDS * np.arange(1, harmonics + 1)
        out = []
        for k in range(self.n):
            a, b = rng.normal(size=(2, harmonics)) * np.minimum(np.minimum(1.0, SPEED / w), acceleration / w**2)
            angle = np.outer(t, w)
            q = np.sin(angle) @ a + np.cos(angle) @ b
            v = np.cos(angle) @ (a * w) - np.sin(angle) @ (b * w)
            c = -np.sin(angle) @ (a * w**2) - np.cos(angle) @ (b * w**2)
            most = self.range[k][1]
            scale = min(0.9 * most / np.abs(q).max(), SPEED / np.abs(v).max(), acceleration / np.abs(c).max())
            out.append(scale * q)
        return np.column_stack(out)


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{words}\n{done.stderr}")


def found(program, arm, log, out):
    run(program, "servo", arm.folder / "arm.xml", "--log", log, "--out", out, "--force")
    return json.loads((out / "servo.json").read_text())


def errors(arm, servo):
    """By parameter: term, relative error, whether the interval holds."""
    out = []
    for p in servo["parameters"]:
        if p["term"] not in TERMS:
            continue
        truth = arm.truth(p["term"], arm.names.index(p["joints"][0]))
        inside = None if p["interval"] is None else p["interval"][0] <= truth <= p["interval"][1]
        out.append((p["term"], p["joints"], (p["value"] - truth) / truth, inside, p["value"] - truth))
    return out


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="target/release/dynid")
    parser.add_argument("--acceleration", type=float, default=20.0)
    args = parser.parse_args()
    gains = {}
    kinds = {kind: {} for kind in ["first", "random", "designed"]}
    holds = {kind: [] for kind in kinds}
    scaled = {}
    for k in range(args.count):
        rng = np.random.default_rng([args.seed, k])
        arm = Arm(rng, args.folder / f"arm{k}")
        log = lambda kind: arm.folder / f"{kind}.csv"
        arm.record(arm.slow(rng), log("first"))
        servo = {"first": found(args.dynid, arm, log("first"), arm.folder / "first")}
        command = arm.random(rng, args.acceleration)
        while (over := arm.record(command, log("random"))) > 1.02:
            command /= over
        servo["random"] = found(args.dynid, arm, log("random"), arm.folder / "random")
        (arm.folder / "design.toml").write_text(
            f'robot = "arm.xml"\ndrives = "first/servo.json"\n[limits]\nvelocity = {SPEED}\nacceleration = {args.acceleration}\n'
            "[safety]\nfloor = false\nself_collision = false\n[search]\nstarts = 4\n")
        run(args.dynid, "design", arm.folder / "design.toml", "--out", arm.folder / "design", "--force")
        design = json.loads((arm.folder / "design" / "design.json").read_text())
        command = np.loadtxt(arm.folder / "design" / "commands.csv", delimiter=",", skiprows=1)[:, 1:]
        over = arm.record(command, log("designed"))
        servo["designed"] = found(args.dynid, arm, log("designed"), arm.folder / "designed")
        std = {p["name"]: p["std"] for p in design["parameters"]}
        by = {kind: {(p["term"], *p["joints"]): p["model_std"] for p in result["parameters"]} for kind, result in servo.items()}
        for key, own in by["designed"].items():
            for kind in ["first", "random"]:
                if own and by[kind].get(key) and key[0] in TERMS:
                    gains.setdefault((key[0], kind), []).append(by[kind][key] / own)
        line = []
        for kind, result in servo.items():
            own = errors(arm, result)
            for term, joints, relative, inside, off in own:
                kinds[kind].setdefault(term, []).append(abs(relative))
                if inside is not None:
                    holds[kind].append(inside)
                name = f"{term} {', '.join(joints)}"
                if kind == "designed" and name in std:
                    # The noise of the forecast is the residual of the first log.
                    noise = np.mean(np.square(result["fit"]["rms"])) ** 0.5 / np.mean(np.square(design["noise"])) ** 0.5
                    scaled.setdefault(term, []).append(off / std[name] / noise)
            line.append(f"{kind} {math.exp(np.mean(np.log([max(abs(e[2]), 1e-6) for e in own]))):.4f} ({result['status']}, {result['fit']['misfit']:.2f})")
        print(f"arm{k} {arm.n} joints:", ", ".join(line), f"beyond limits by {over:.3f}", f"forecast gain {design['random']['geometric_ratio']:.2f}" if design["random"] else "", flush=True)
    mean = lambda x: math.exp(np.mean(np.log(np.maximum(x, 1e-6))))
    for term in TERMS:
        print(f"{term:14}", ", ".join(f"{kind} {mean(kinds[kind][term]):.5f}" for kind in kinds),
              f"| standard deviations over designed: first {mean(gains[term, 'first']):.2f}, random {mean(gains[term, 'random']):.2f}",
              f"| over forecast {np.sqrt(np.mean(np.square(scaled[term]))):.2f}, median {np.median(np.abs(scaled[term])) / 0.6745:.2f}")
    for kind in kinds:
        print(f"{kind}: all {mean(sum(kinds[kind].values(), [])):.5f}, intervals hold {100 * np.mean(holds[kind]):.1f} %")


if __name__ == "__main__":
    main()
