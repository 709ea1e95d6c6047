"""Friction experiments on arrays."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest
from numpy.typing import NDArray

ROBOT = """schema = 1
name = "pair"
dh = "modified"
[[joint]]
name = "j1"
d = 0.3
[[joint]]
name = "j2"
a = 0.45
alpha = "90deg"
"""
COULOMB, STATIC, SPEED, VISCOUS, INERTIA = 9.0, 12.0, 0.05, 4.0, 1.4
SIGMA0, SIGMA1 = 16000.0, 270.0


def steady(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return COULOMB + (STATIC - COULOMB) * np.exp(-((v / SPEED) ** 2)) + VISCOUS * v


def sweep(seed: int, directions: tuple[float, ...] = (1.0, -1.0), largest: float = 2.4) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """One joint forth and back at 16 speeds under gravity, the other at rest: `t`, `q`, `tau`."""
    rng, dt = np.random.default_rng(seed), 0.01
    parts = []
    for speed in np.geomspace(0.01, largest, 16):
        for direction in directions:
            parts += [np.full(int(np.clip(2.4 / speed, 1.2, 4.0) / dt), direction * speed), np.zeros(30)]
    v = np.concatenate(parts)
    q = 0.2 + np.concatenate([[0.0], np.cumsum(v[:-1]) * dt])
    tau = 8 * np.cos(q + 0.3) + np.sign(v) * steady(np.abs(v)) * (v != 0) + 0.2 * rng.normal(size=len(v))
    rest = np.full_like(q, 0.1)
    return np.arange(len(v)) * dt, np.stack([q, rest], axis=1), np.stack([tau, np.full_like(q, 1.5)], axis=1)


def presliding() -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """The bristles alone hold the joint against an effort below static friction, 2 kHz."""
    dt, parts = 0.5e-3, 50
    t = np.arange(3000) * dt
    tau = 0.5 * STATIC * (np.sin(2 * np.pi * 3 * t) + 0.5 * np.sin(2.3 * 2 * np.pi * 3 * t))
    q, state = np.zeros_like(t), [0.0, 0.0, 0.0]
    for k, effort in enumerate(tau):
        q[k], h = state[0], dt / parts
        for _ in range(parts):
            at, v, z = state
            g = float(steady(np.array(abs(v)))) - VISCOUS * abs(v)
            bend = v - SIGMA0 * abs(v) * z / g
            v += h * (effort - SIGMA0 * z - SIGMA1 * bend - VISCOUS * v) / INERTIA
            state = [at + h * v, v, z + h * (v - SIGMA0 * abs(v) * z / g)]
    rest = np.full_like(q, 0.1)
    return t, np.stack([q, rest], axis=1), np.stack([tau, 0 * q], axis=1)


@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_experiments_give_the_law_and_the_bristles_that_files_give(tmp_path: Path) -> None:
    pair = dynid.Robot.parse(ROBOT, "pair.toml")
    steps: list[str] = []
    logs = [sweep(1), sweep(2)]
    slow = dynid.PreslidingLog(dynid.Log(*presliding(), name="slow"), "j1", INERTIA)
    found = dynid.friction(pair, [dynid.Log(*logs[0]), dynid.FrictionLog(dynid.Log(*logs[1]), "j1")], slow, progress=steps.append)
    assert any("j1" in step for step in steps), steps
    (joint,) = found.joints.rows()
    assert found.status in ("pass", "warn") and joint["joint"] == "j1" and joint["status"] in ("identified", "simplified"), found
    assert joint["coulomb"] == pytest.approx(COULOMB, rel=0.03) and joint["static"] == pytest.approx(STATIC, rel=0.05)
    assert joint["stribeck_speed"] == pytest.approx(SPEED, rel=0.15)
    assert joint["bristle"]["sigma0"] == pytest.approx(SIGMA0, rel=0.1) and joint["bristle"]["sigma1"] == pytest.approx(SIGMA1, rel=0.2)
    points = found.points
    assert len(points["speed"]) >= 12 and set(points["temperature"]) == {None}
    assert np.abs(np.array(points["friction"]) - steady(np.array(points["speed"]))).max() < 0.5
    assert "<html" in found.report().lower() and "Friction" in repr(found)

    # The command line finds the same in files.
    for name, (t, q, tau) in {"a": logs[0], "b": logs[1], "slow": presliding()}.items():
        np.savetxt(tmp_path / f"{name}.csv", np.column_stack([t, q, tau]), delimiter=",", header="t,q_j1,q_j2,tau_j1,tau_j2", comments="", fmt="%.17g")
    (tmp_path / "pair.toml").write_text(ROBOT)
    entries = '[[log]]\npath = "a.csv"\n[[log]]\npath = "b.csv"\njoint = "j1"\n[[presliding]]\npath = "slow.csv"\njoint = "j1"\n'
    (tmp_path / "friction.toml").write_text(f'robot = "pair.toml"\n{entries}inertia = {INERTIA}\n')
    program = [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())", "friction", "friction.toml"]
    ended = subprocess.run([*program, "--json", "--quiet"], cwd=tmp_path, capture_output=True, check=False)
    told = json.loads(ended.stdout)

    def numbers(record: dict[str, Any]) -> str:
        # Logs of files have other names.
        for joint in record["joints"]:
            for part in [*joint["presliding"], *joint["unpaired"]]:
                del part["log"]
        return json.dumps(record["joints"])

    of_files = numbers(told)
    assert of_files == numbers(found.record), ended.stderr
    of_paths = dynid.friction(
        tmp_path / "pair.toml",
        [tmp_path / "a.csv", dynid.FrictionLog(str(tmp_path / "b.csv"), "j1")],
        dynid.PreslidingLog(tmp_path / "slow.csv", "j1", INERTIA),
    )
    assert of_files == numbers(of_paths.record)

    # What it leaves behind stands in an identification.
    found.save(tmp_path / "friction.json")
    t, q, tau = logs[0]
    estimate = dynid.identify(pair, dynid.Log(t, q[:, :1], tau[:, :1], joints=["j1"]), elements={"known_friction": str(tmp_path / "friction.json")}, preflight="off")
    assert estimate.record["model"]["known_friction"][0]["joint"] == "j1"


@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_what_experiments_cannot_tell_is_said() -> None:
    pair = dynid.Robot.parse(ROBOT, "pair.toml")
    forth = dynid.friction(pair, dynid.Log(*sweep(1, (1.0,), 0.3)))
    assert forth.status == "fail" and forth.joints["status"] == ["one_direction"]
    t, q, tau = sweep(1)
    with pytest.raises(dynid.LogError, match="constant speed"):
        dynid.friction(pair, dynid.Log(t, q + np.sin(3 * t)[:, None], tau))
    with pytest.raises(dynid.DynidError, match="at least one log"):
        dynid.friction(pair, [])
    with pytest.raises(dynid.DynidError, match="j7"):
        dynid.friction(pair, dynid.FrictionLog(dynid.Log(t, q, tau), "j7"))
    with pytest.raises(dynid.SettingError, match="inertia"):
        dynid.friction(pair, dynid.Log(t, q, tau), dynid.PreslidingLog(dynid.Log(*presliding()), "j1", -1.0))
    with pytest.raises(dynid.SettingError, match="reference_temprature"):
        dynid.friction(pair, dynid.Log(t, q, tau), reference_temprature=30)
    with pytest.raises(TypeError, match="Log.read"):
        dynid.friction(pair, dynid.Log(t, q, tau), columns={"effort": "tau{}"})
