#!/usr/bin/env python3
"""Accuracy on simulated arms with known truth: makes them, identifies them by the program, compares two programs.

    arms.py make  FOLDER [--count 60] [--seed 1] [--dynid PROGRAM]
    arms.py rest  FOLDER [--dynid PROGRAM]
    arms.py score FOLDER [--dynid PROGRAM] [--out SCORES.json] [--settings KEYS.toml] [--logs train|singles|poses]
    arms.py compare BEFORE.json AFTER.json

Arms have 4 to 7 joints; friction is linear, falls from rest (Stribeck), differs by direction, grows as a power of speed, or is mixed. Logs come
from a simulated controller, with noise, encoder steps, delay, ripple, outliers, missing rows and a clock that jitters. The robot file that
identification gets has other inertias than the truth: scaled and turned, or uniform links where the truth has its mass at the ends.
The error is that of the data's README: root mean square over joints of (rms of clean true effort minus prediction at the true states, where
|v| > 0.02 rad/s) over the rms of the true effort, on two motions that were not fitted. The true effort is what a controller must give: less the
ripple that the drive adds. Needs numpy.

`rest` adds logs in which joints stand: `singles`, one per joint that moves at three speeds while the others hold still, which `score` fits beside the
log of all joints; and `poses`, moves of some joints from pose to pose with pauses, which it fits in place of it.
"""

import argparse
import gzip
import json
import math
import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

KINDS = ["linear", "stribeck", "asymmetric", "power", "mixed"]
SLOWEST = 0.02  # rad/s: below, the prediction is not compared


def rotation(rng):
    """A random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def body(rng, mass, length):
    """Mass, centre of mass and inertia about it of a bent tube with a drive at an end."""
    radius = 0.25 * length * rng.uniform(0.3, 0.7)
    com = np.array([rng.uniform(0.2, 0.6) * length, 0.0, 0.0])
    axial, across = 0.5 * mass * radius**2, mass * (length**2 / 12 + radius**2 / 4)
    turn = rotation(rng) if rng.random() < 0.3 else np.eye(3)
    axes = [np.eye(3), np.eye(3)[[1, 0, 2]], np.eye(3)[[1, 2, 0]]][rng.integers(3)]
    com = axes @ com + rng.normal(size=3) * 0.02
    return mass, com, turn @ axes @ np.diag([axial, across, across]) @ axes.T @ turn.T


def wrong(rng, true, spread):
    """What a robot file says of a body: scaled and turned."""
    mass, com, inertia = true
    values, vectors = np.linalg.eigh(inertia)
    turn = vectors if spread < 0.35 else rotation(rng) @ vectors
    # Second moments stay positive, so that the body can exist.
    moments = np.maximum(0.5 * values.sum() - values, 1e-3 * values.sum()) * np.exp(rng.normal(size=3) * spread)
    inertia = turn @ np.diag(moments.sum() - moments) @ turn.T
    factor = math.exp(rng.normal() * spread)
    return mass * factor, com + rng.normal(size=3) * 0.15 * spread, factor * inertia


def uniform(true, length):
    """What a robot file made of a shape with one density says."""
    mass = true[0]
    return mass, np.array([0.5 * length, 0.0, 0.0]), np.diag([0.01 * length**2, 1 / 12, 1 / 12]) * mass * max(length, 0.05) ** 2


def joint_text(k, row, limits, inertia):
    """A row of a robot file."""
    mass, com, i = inertia
    a, alpha, d = row
    six = [i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2]]
    return (
        f'[[joint]]\nname = "j{k}"\na = {a:.4f}\nalpha = "{alpha}deg"\nd = {d:.4f}\n'
        f'limits = {{ position = ["-{limits[0]}deg", "{limits[0]}deg"], velocity = {limits[1]:.3f}, effort = 1000 }}\n'
        f"mass = {mass!r}\ncom = {[float(x) for x in com]}\ninertia_com = {[float(x) for x in six]}\n"
    )


def friction_of(kind, rng, scale, speed):
    """Elements of a joint with their stated values, and values that a robot file has no key for."""
    fc, fv = scale * rng.uniform(0.06, 0.2), scale * rng.uniform(0.03, 0.15) / speed
    values = {}
    lines = {"coulomb": f"coulomb = {{ effort = {fc:.5g} }}", "viscous": f"viscous = {{ coefficient = {fv:.5g} }}"}
    if kind == "stribeck":
        vs, fs = speed * rng.uniform(0.02, 0.12), fc * rng.uniform(1.15, 1.7)
        lines["stribeck"] = f"stribeck = {{ coulomb = {fc:.5g}, static = {fs:.5g}, vs = {{ start = {vs:.5g}, held = true }}, delta = {{ held = true }} }}"
        del lines["coulomb"]
    elif kind == "asymmetric":
        values = {"fcp": fc, "fcn": fc * rng.uniform(0.6, 0.9), "fvp": fv, "fvn": fv * rng.uniform(0.7, 1.3)}
        lines = {"asymmetric": ""}
    elif kind == "power":
        b = rng.uniform(0.4, 0.7)
        lines["power"] = f"power = {{ coefficient = {fv * speed ** (1 - b):.5g}, p = {{ start = {b:.3f}, held = true }} }}"
        del lines["viscous"]
    return lines, values


def make_one(folder, number, seed, dynid):
    """Files of one arm: truth, robot file, a log to fit, two motions to predict."""
    for attempt in range(20):
        about = draw(folder, number, [seed, number, attempt], dynid)
        if about is not None:
            return about
    raise SystemExit(f"arm {number}: no draw has a stable controller")


def shakes(log, rate):
    """Whether the controller is not stable: velocities above 10 Hz hold more than 1 % of their power."""
    for name, q in log.items():
        if name.startswith("q"):
            power = np.abs(np.fft.rfft(np.diff(q) - np.mean(np.diff(q)))) ** 2
            band = np.fft.rfftfreq(len(q) - 1, 1 / rate) > 10
            if power[band].sum() > 0.01 * power.sum():
                return True
    return False


def draw(folder, number, seeds, dynid):
    """Files of one arm, or nothing where its controller shakes it."""
    rng = np.random.default_rng(seeds)
    here = folder / f"{number:03d}"
    shutil.rmtree(here, ignore_errors=True)
    here.mkdir(parents=True)
    n = int(rng.integers(4, 8))
    kind = KINDS[number % len(KINDS)]
    geometry = ["scaled", "far", "uniform"][int(rng.integers(3))]
    speed = float(rng.uniform(1.2, 2.8))
    alphas = [0] + [int(rng.choice([90, -90])) for _ in range(n - 1)]
    if n > 3:
        alphas[2] = 0
    mass, truths, files, fric, kinds, values = float(rng.uniform(4, 12)), [], [], [], [], {}
    has_offset, has_rotor = bool(rng.random() < 0.5), bool(rng.random() < 0.7)
    reach = [float(rng.uniform(0.25, 0.5)) if k in (1, 2) else float(rng.uniform(0.05, 0.2)) for k in range(n)]
    for k in range(n):
        true = body(rng, mass, max(reach[k], 0.12))
        if geometry == "uniform":
            # The truth has a heavy drive at the far end, the file a shape of one density.
            end = np.array([reach[k], 0.0, rng.normal() * 0.03])
            total, extra = true[0], 0.5 * true[0]
            com = (total * true[1] + extra * end) / (total + extra)

            def square(r):
                return (r @ r) * np.eye(3) - np.outer(r, r)

            inertia = true[2] + total * square(true[1] - com) + extra * square(end - com) + 1e-3 * extra * np.eye(3)
            true = (total + extra, com, inertia)
            file = uniform(true, reach[k])
        else:
            file = wrong(rng, true, 0.25 if geometry == "scaled" else 0.6)
        row = (0.0 if k == 0 else reach[k - 1] if k in (2, 3) else 0.0, alphas[k], float(rng.uniform(0, 0.3)))
        limits = (int(rng.integers(80, 170)), speed * (1.0 if k < 3 else 1.3))
        truths.append(joint_text(k + 1, row, limits, true))
        files.append(joint_text(k + 1, row, limits, file))
        own = kind if kind != "mixed" else KINDS[int(rng.integers(4))]
        scale = 9.81 * mass * 0.3 * (n - k) / n + 2.0
        lines, of_joint = friction_of(own, rng, scale, limits[1])
        values.update({f"j{k + 1}.{name}": float(x) for name, x in of_joint.items()})
        if has_offset and "asymmetric" not in lines:
            lines["offset"] = f"offset = {{ effort = {scale * rng.normal() * 0.02:.5g} }}"
        if has_rotor:
            lines["rotor"] = f"rotor = {{ inertia = {mass * 0.01 * rng.uniform(0.3, 2):.5g} }}"
        fric.append(f"[element.j{k + 1}]\nelements = {json.dumps(list(lines))}\n" + "\n".join(filter(None, lines.values())) + "\n")
        kinds.append(own)
        mass *= float(rng.uniform(0.55, 0.9))
    head = f'schema = 1\nname = "arm{number}"\ndh = "modified"\n\n'
    (here / "truth.toml").write_text(head + "".join(truths) + "".join(fric))
    (here / "robot.toml").write_text(head + "".join(files))
    rate = int(rng.choice([100, 125, 250, 500, 1000]))
    duration = float(rng.choice([12, 20, 30]))
    sim = {
        "mode": "closed_loop",
        "duration_s": duration,
        "rate_hz": rate,
        "harmonics": int(rng.integers(4, 9)),
        "effort_noise": float(np.exp(rng.uniform(np.log(0.003), np.log(0.05)))),
        "encoder_bits": int(rng.integers(15, 21)),
        "delay_samples": float(rng.uniform(0, 1.5)),
        "acceleration": float(rng.uniform(3, 9)),
        "seed": int(rng.integers(1, 10**6)),
    }
    faults = {
        "encoder_noise": 0.0,
        "ripple_share": float(rng.choice([0.0, 0.005, 0.01])),
        "outlier_share": float(rng.choice([0.0, 1e-3])),
        "dropped_share": float(rng.choice([0.0, 1e-3])),
        "clock_jitter_s": float(rng.choice([0.0, 5e-5])),
    }
    about = {"number": number, "joints": n, "kind": kind, "kinds": kinds, "geometry": geometry, "offset": has_offset, "rotor": has_rotor, **sim, **faults}
    (here / "about.json").write_text(json.dumps(about, indent=1))

    def toml(d):
        return "".join(f"{k} = {json.dumps(v)}\n" for k, v in d.items())

    stated = "[values]\n" + "".join(f'"{k}" = {v!r}\n' for k, v in values.items())
    control = {"bandwidth_hz": float(rng.uniform(1.0, 3.0)), "velocity_cutoff_hz": 200}
    (here / "train.toml").write_text(toml(sim) + "[control]\n" + toml(control) + "[imperfections]\n" + toml(faults) + stated)

    def run(*args):
        return subprocess.run([dynid, "simulate", str(here / "truth.toml"), *map(str, args)], check=True, capture_output=True)

    run("--config", here / "train.toml", "--out", here / "train.csv.gz", "--truth", here / "truth.json")
    if shakes(table(here / "train.csv.gz"), rate):
        return None
    for name, harmonics, share in [("fast", 7, 0.8), ("slow", 3, 0.5)]:
        config = {
            "duration_s": 12,
            "rate_hz": 200,
            "harmonics": harmonics,
            "effort_noise": 0,
            "encoder_bits": 0,
            "delay_samples": 0,
            "share": share,
            "acceleration": 6,
            "seed": sim["seed"] + 7 + len(name) + harmonics,
        }
        (here / f"{name}.toml").write_text(toml(config) + stated)
        run("--config", here / f"{name}.toml", "--out", here / f"{name}.csv.gz", "--clean", here / f"{name}_clean.csv.gz")
    return about


def leg(start, end, rate, duration):
    """A move between two poses, of fifth order: at rest at either end."""
    x = np.arange(1, round(duration * rate) + 1)[:, None] / round(duration * rate)
    return start + (end - start) * (10 * x**3 - 15 * x**4 + 6 * x**5)


def single(joint, pose, limit, rate):
    """One joint forth and back at three speeds, each reached within 0.2 s."""
    q = [np.tile(pose, (round(0.5 * rate), 1))]
    for share in (0.1, 0.3, 0.8):
        speed = share * limit
        for sign in (1, -1, -1, 1):
            travel = min(1.5, 0.5 / speed)
            ramp = np.concatenate([np.linspace(0, 1, round(0.2 * rate)), np.ones(round(travel * rate)), np.linspace(1, 0, round(0.2 * rate))])
            way = np.tile(q[-1][-1], (len(ramp), 1))
            way[:, joint] += sign * speed * np.cumsum(ramp) / rate
            q.append(way)
            q.append(np.tile(way[-1], (round(0.3 * rate), 1)))
    return np.concatenate(q)


def poses(rng, limits, rate, duration):
    """From pose to pose: every move takes about a third of the joints, and pauses follow."""
    pose = np.zeros(len(limits))
    q = [np.tile(pose, (round(0.5 * rate), 1))]
    while sum(map(len, q)) < duration * rate:
        moves = rng.random(len(limits)) < 0.4
        target = np.where(moves, rng.uniform(-0.7, 0.7, len(limits)) * [x[0] for x in limits], pose)
        # The peak speed of such a move is 1.875 of the mean.
        least = max(1.875 * np.abs(target - pose) / (0.8 * np.array([x[1] for x in limits])))
        q.append(leg(pose, target, rate, max(least, 0.4)))
        q.append(np.tile(target, (round(rng.uniform(0.2, 0.8) * rate), 1)))
        pose = target
    return np.concatenate(q)


def rest_one(here, dynid):
    """Logs of an arm in which joints stand."""
    about = json.loads((here / "about.json").read_text())
    rng, n, rate = np.random.default_rng([5, about["number"]]), about["joints"], about["rate_hz"]
    found = re.findall(r'position = \["-(\d+)deg".*velocity = ([\d.]+)', (here / "robot.toml").read_text())
    limits = [(math.radians(float(p)), float(v)) for p, v in found]
    base = rng.uniform(-0.4, 0.4, n) * [p for p, _ in limits]
    motions = {f"single{k + 1}": single(k, base, limits[k][1], rate) for k in range(n)}
    motions["poses"] = poses(rng, limits, rate, 25)
    keys = (here / "train.toml").read_text()
    keys = re.sub(r"(?m)^(duration_s|harmonics|acceleration) = .*\n", "", keys)
    for name, q in motions.items():
        dq, t = np.gradient(q, 1 / rate, axis=0), np.arange(len(q)) / rate
        ddq = np.gradient(dq, 1 / rate, axis=0)
        header = ",".join(["t"] + [f"{of}_j{k + 1}" for of in ("q", "dq", "ddq") for k in range(n)])
        np.savetxt(here / f"{name}_motion.csv", np.column_stack([t, q, dq, ddq]), delimiter=",", header=header, comments="")
        (here / f"{name}.toml").write_text(f'follow = "{name}_motion.csv"\n' + keys)
        made = subprocess.run(
            [dynid, "simulate", str(here / "truth.toml"), "--config", str(here / f"{name}.toml"), "--out", str(here / f"{name}.csv.gz"), "--force"],
            capture_output=True,
            text=True,
        )
        if made.returncode:
            raise SystemExit(f"{here}: {made.stderr}")


def table(path):
    """Columns of a table by name."""
    opened = gzip.open(path, "rt") if str(path).endswith(".gz") else open(path)
    with opened as file:
        names = file.readline().strip().split(",")
        return dict(zip(names, np.loadtxt(file, delimiter=",", ndmin=2).T, strict=False))


SYMBOL = re.compile(r"\b([A-Za-z]+)(\d+)\b")
OF_LINKS = {"m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"}


def of_truth(expression, truth):
    """Value of a base parameter: sums of multiples of standard ones, `Izz1 + 0.42 (m4 + m5) + Ia1`."""
    text = re.sub(r"(?<![A-Za-z0-9.])(\d[\d.e-]*) +(?=[A-Za-z(])", r"\1*", expression)

    def value(m):
        return repr(truth.get(f"{'link' if m[1] in OF_LINKS else 'j'}{m[2]}.{m[1]}", 0.0))

    return eval(SYMBOL.sub(value, text), {"__builtins__": {}})  # numbers, signs and brackets alone


def score_one(here, dynid, settings, logs):
    """Error on both motions, coverage of intervals, shapes that were taken."""
    about = json.loads((here / "about.json").read_text())
    out = here / ("out-" + str(os.getpid()))
    config = here / f"run-{os.getpid()}.toml"
    names = {"train": ["train"], "poses": ["poses"], "singles": ["train"] + [f"single{k + 1}" for k in range(about["joints"])]}[logs]
    listed = ", ".join(f'{{ path = "{name}.csv.gz" }}' for name in names)
    config.write_text(f'robot = "robot.toml"\nlog = [{listed}]\n{settings}')
    command = [dynid, "identify", config, "--out", out]
    ran = subprocess.run(list(map(str, command)), capture_output=True, text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
    if not (out / "estimate.json").exists():
        return {**about, "failed": ran.stderr[-400:]}
    estimate = json.loads((out / "estimate.json").read_text())
    truth = json.loads((here / "truth.json").read_text())
    ripple = truth["experiment"]["ripple"] or [(0.0, 1.0, 0.0)] * about["joints"]
    errors = {}
    for name in ("fast", "slow"):
        clean = table(here / f"{name}_clean.csv.gz")
        n = about["joints"]
        rows = {f"{to}{k}": clean[f"{of}j{k}"] for to, of in (("q", "q_"), ("dq", "dq_"), ("ddq", "ddq_")) for k in range(1, n + 1)}
        states = here / f"states-{os.getpid()}-{name}.csv"
        np.savetxt(states, np.array(list(rows.values())).T, delimiter=",", header=",".join(rows), comments="")
        text = subprocess.run([dynid, "predict", out / "estimate.json", "--states", states], check=True, capture_output=True, text=True).stdout
        found = np.array([[float(x) for x in line.split(",")] for line in text.splitlines()[1:]])
        states.unlink()
        total = 0.0
        for k in range(n):
            amplitude, cycles, phase = ripple[k]
            true = clean[f"tau_j{k + 1}"] - amplitude * np.sin(cycles * rows[f"q{k + 1}"] + phase)
            moves = np.abs(rows[f"dq{k + 1}"]) > SLOWEST
            total += np.mean((true[moves] - found[moves, k]) ** 2) / np.mean(true**2)
        errors[name] = math.sqrt(total / n)
    truth = truth.get("parameters", truth)
    truth = {p["name"]: p["value"] for p in truth} if isinstance(truth, list) else truth
    for k, (amplitude, _, phase) in enumerate(ripple):
        truth |= {f"j{k + 1}.ca": -amplitude * math.sin(phase), f"j{k + 1}.cb": -amplitude * math.cos(phase)}
    # A joint whose law is not that of the truth has other coefficients than the truth's.
    shaped = {s["name"].split(".")[0] for s in estimate.get("shape_parameters", []) if not s["name"].endswith("cycles")}
    right = {f"j{k + 1}" for k, kind in enumerate(about["kinds"]) if kind == "linear"} - shaped
    inside = seen = 0
    for p in estimate["base_parameters"]:
        owner = p["name"].split(".")[0]
        if p.get("half_width") is None or p.get("value") is None or p.get("verdict") not in (None, "seen in the data"):
            continue
        if owner.startswith("j") and owner not in right:
            continue
        seen += 1
        inside += abs(p["value"] - of_truth(p["expression"], truth)) <= p["half_width"]
    choices = {c["name"]: c for c in estimate["conditioning"]["choices"]}
    taken = {name.split()[-1]: c["value"] for name, c in choices.items() if name.startswith("friction shapes of ")}
    shutil.rmtree(out)
    config.unlink()
    return {
        **about,
        **errors,
        "inside": inside,
        "seen": seen,
        "taken": taken,
        "verdict": estimate["verdict"]["status"],
        "kernel_hz": choices["kernel cut-off"]["value"],
        "state_hz": choices["state cut-off"]["value"],
    }


def compare(before, after):
    """Ratios of errors, arm by arm."""
    old, new = (({s["number"]: s for s in json.loads(Path(p).read_text())}) for p in (before, after))
    logs, worse = [], []
    for number in sorted(set(old) & set(new)):
        a, b = old[number], new[number]
        if "failed" in a or "failed" in b:
            print(f"{number:3d} failed {a.get('failed', '')} {b.get('failed', '')}")
            continue
        ratio = math.sqrt(b["fast"] * b["slow"] / (a["fast"] * a["slow"]))
        logs.append(math.log(ratio))
        if ratio > 1.05:
            worse.append(number)
        print(f"{number:3d} {a['kind']:10s} {a['geometry']:8s} {a['fast']:.5f} {a['slow']:.5f} -> {b['fast']:.5f} {b['slow']:.5f}  {ratio:.3f}")
    cover = [sum(s.get("inside", 0) for s in x.values()) / max(1, sum(s.get("seen", 0) for s in x.values())) for x in (old, new)]
    for name, x in (("before", old), ("after", new)):
        verdicts = [s.get("verdict") for s in x.values()]
        print(f"{name}: {', '.join(f'{verdicts.count(v)} {v}' for v in ('ok', 'warn', 'fail'))}")
    print(f"geometric mean of ratios {math.exp(sum(logs) / len(logs)):.4f}; more than 5 % worse: {worse}; coverage {cover[0]:.4f} -> {cover[1]:.4f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["make", "rest", "score", "compare"])
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="target/release/dynid")
    parser.add_argument("--settings", type=Path, help="further keys of the configuration")
    parser.add_argument("--logs", choices=["train", "singles", "poses"], default="train")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    settings = args.settings.read_text() if args.settings else ""
    if args.what == "compare":
        return compare(*args.paths)
    folder = args.paths[0]
    with ThreadPoolExecutor(2) as pool:
        if args.what == "make":
            list(pool.map(lambda k: make_one(folder, k, args.seed, args.dynid), range(args.count)))
            return None
        arms = sorted(p for p in folder.iterdir() if (p / "train.csv.gz").exists())[: args.count]
        if args.what == "rest":
            list(pool.map(lambda here: rest_one(here, args.dynid), arms))
            return None
        scores = list(pool.map(lambda here: score_one(here, args.dynid, settings, args.logs), arms))
    text = json.dumps(scores, indent=1)
    (args.out or Path(folder / "scores.json")).write_text(text)
    good = [s for s in scores if "failed" not in s]
    mean = math.exp(sum(math.log(s["fast"] * s["slow"]) / 2 for s in good) / len(good))
    print(
        f"{len(good)} of {len(scores)} arms, geometric mean of errors {mean:.5f}, coverage {sum(s['inside'] for s in good)} of {sum(s['seen'] for s in good)}"
    )
    return None


if __name__ == "__main__":
    main()
