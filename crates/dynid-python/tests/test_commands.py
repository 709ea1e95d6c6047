"""Pre-flight, designs, identification on line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest


def test_preflight(indy7: dynid.Robot, made: dynid.Simulation) -> None:
    assert all(severity == "info" for severity in dynid.check(indy7, made.log)["severity"])
    swapped = made.tau.copy()
    swapped[:, [1, 2]] = swapped[:, [2, 1]]
    found = dynid.check(indy7, dynid.Log(made.t, made.q, swapped))
    assert found.rows()[0]["id"] == "joint_permutation" and found["severity"][0] == "error"
    turned = dynid.check(indy7, dynid.Log(made.t, made.q, -made.tau))
    assert any("sign" in name for name in turned["id"]), turned
    twice = dynid.check(indy7, [made.log, made.log])
    assert "repeated_log" in twice["id"]


def test_estimators_are_compared_as_the_command_line_does(tmp_path: Path) -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=20, rate_hz=100, seed=4)
    steps: list[str] = []
    found = dynid.compare(arm, made.log, progress=steps.append)
    assert any("of" in step and "wls" in step for step in steps), steps
    rows = found.estimators.rows()
    assert found.best == rows[0]["name"] and rows[0]["rank"] == 1 and rows[0]["error"] < 5
    assert {"textbook", "ols", "wls", "consistent"} <= {row["name"] for row in rows}
    assert set(found.joints["joint"]) == set(arm.joints) and min(found.joints["rms"]) > 0
    assert "<html" in found.report().lower() and str(found.best) in repr(found)
    again = dynid.compare(arm, made.log, threads=1)
    same = [{k: v for k, v in row.items() if k != "seconds"} for row in rows]
    assert [{k: v for k, v in row.items() if k != "seconds"} for row in again.estimators.rows()] == same

    (tmp_path / "arm.toml").write_text(dynid.examples.TWO_LINKS)
    columns = np.column_stack([made.t, made.q, made.tau])
    header = ",".join(["t", *(f"{s}_{j}" for s in ("q", "tau") for j in arm.joints)])
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header=header, comments="", fmt="%.17g")
    program = [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())", "compare", "arm.toml"]
    ended = subprocess.run([*program, "--log", "log.csv", "--json", "--quiet"], cwd=tmp_path, capture_output=True, check=False)
    told = json.loads(ended.stdout)["estimators"]
    assert [{k: row[k] for k in same[0]} for row in told] == same, ended.stderr

    with pytest.raises(dynid.SettingError, match="belongs to the robot|gravity"):
        dynid.compare(arm, made.log, gravity=[0, 0, 0])
    with pytest.raises(dynid.DynidError, match="at least one log"):
        dynid.compare(arm, [])


def test_drive_gains_by_a_known_payload(tmp_path: Path) -> None:
    bare = dynid.examples.TWO_LINKS
    stated = "mass = 2\ncom = [0, 0.01, 0.15]\ninertia_com = [0.02, 0, 0, 0.02, 0, 0.004]"
    assert stated in bare
    # 1.5 kg at 0.3 m on the axis of the forearm.
    com = "[0, 0.005714285714285714, 0.21428571428571427]"
    about = "[0.039371428571428574, 0, 0, 0.039285714285714285, 0.0012857142857142856, 0.004085714285714286]"
    heavy = bare.replace(stated, f"mass = 3.5\ncom = {com}\ninertia_com = {about}")
    gains = np.array([8.0, 5.0])
    logs = []
    for seed, text in enumerate((bare, heavy)):
        made = dynid.simulate(dynid.Robot.parse(text, "arm.toml"), duration_s=40, rate_hz=250, seed=seed + 1)
        carries: dict[str, Any] = {"payload": "tool"} if seed else {}
        logs.append(dynid.Log(made.t, made.q, made.tau / gains, name=f"log{seed}", **carries))
    arm = dynid.Robot.parse(bare, "arm.toml")
    tool = {"name": "tool", "mass": 1.5, "com": [0, 0, 0.3]}
    found = dynid.gains(arm, logs, payload=[tool])
    assert found.status == "ok" and found.joints["joint"] == arm.joints
    for row, true in zip(found.joints.rows(), gains, strict=True):
        assert row["verdict"] == "determined" and abs(row["gain"] - true) < 4 * row["std"] and row["std"] < 0.1 * true, row
        assert row["low"] < row["gain"] < row["high"] and row["unit"] == "N m/A"
    with pytest.raises(dynid.SettingError, match="payload"):
        dynid.gains(arm, logs)
    with pytest.raises(dynid.SettingError, match="without it"):
        dynid.gains(arm, logs[1], payload=[tool])
    with pytest.raises(dynid.SettingError, match="`other`"):
        dynid.gains(arm, logs, payload=[{**tool, "name": "other"}])
    with pytest.raises(dynid.SettingError, match="`bound`: does nothing"):
        dynid.gains(arm, logs, payload=[tool], bound=[{"parameter": "elbow.fc", "range": [0, 1]}])
    with pytest.raises(dynid.SettingError, match="expected `wls`"):
        dynid.gains(arm, logs, payload=[tool], estimator={"method": "huber"})
    with pytest.raises(dynid.DynidError, match="at least one log"):
        dynid.gains(arm, [], payload=[tool])
    # Currents of motors that joints share have no gain per joint.
    columns = np.column_stack([made.t, made.q, made.tau])
    header = ",".join(["t", *(f"{s}_{j}" for s in ("q", "tau") for j in arm.joints)])
    np.savetxt(tmp_path / "motors.csv", columns, delimiter=",", header=header, comments="")
    motors = dynid.Log.read(tmp_path / "motors.csv", motor_side={"matrix": [[1, 0], [1, 1]]})
    with pytest.raises(dynid.UnsupportedError, match="transmission matrix"):
        dynid.gains(arm, [motors, logs[1]], payload=[tool])


def test_a_design_is_followed_and_tells_what_it_said() -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    steps: list[str] = []
    wanted: dict[str, Any] = {
        "trajectory": {"period_s": 8, "harmonics": 4, "sample_rate_hz": 200},
        "limits": {"acceleration": 10},
        "search": {"starts": 2},
    }
    made = dynid.design(arm, progress=steps.append, **wanted)
    assert made.feasible and made.joints == arm.joints and made.q.shape == (len(made.t), 2) and any("starts" in s for s in steps)
    assert np.abs(made.v).max() <= 3 and np.abs(made.q).max() <= 2 and np.abs(made.a).max() <= 10 * (1 + 1e-6)
    # A difference over a step is off by half the step times the acceleration at most.
    assert np.abs(np.diff(made.q, axis=0) * 200 - made.v[:-1]).max() <= 10 * (1 + 1e-6) / 200 / 2
    assert "<html" in made.report().lower()
    again = dynid.design(arm, threads=1, **wanted)
    assert (again.q == made.q).all()
    # Efforts along the motion, and back.
    tau = arm.inverse_dynamics(made.q, made.v, made.a) + 2 * made.v + 3 * np.sign(made.v)
    noise = 0.01 * np.random.default_rng(1).normal(size=tau.shape) * tau.std(axis=0)
    found = dynid.identify(arm, dynid.Log(made.t, made.q, tau + noise), elements={"default": ["viscous", "coulomb"]})
    truth = {"shoulder.fv": 2.0, "shoulder.fc": 3.0, "elbow.fv": 2.0, "elbow.fc": 3.0}
    for name, value in truth.items():
        row = next(p for p in found.record["parameters"] if p["name"] == name)
        assert abs(row["value"] - value) < 4 * row["std"], row
    with pytest.raises(TypeError, match="belong to the robot"):
        dynid.design(arm, gravity=[0, 0, 0])
    with pytest.raises(dynid.SettingError, match="perid"):
        dynid.design(arm, trajectory={"perid": 3})
    none = dynid.design(arm, limits={"effort": 0.1}, search={"starts": 1})
    assert not none.feasible and none.headline


def test_what_to_record_next() -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=10, rate_hz=200, seed=1)
    found = dynid.identify(arm, made.log)
    so_far = found.reduce(made.log)
    before = {p["name"]: p["half_width"] for p in found.record["base_parameters"]}
    steps: list[str] = []
    want: dict[str, float | str] = {"shoulder.fv": "0.5%", "elbow.fc": 1e3}
    asked: dict[str, Any] = {"limits": {"acceleration": 10}, "search": {"starts": 1}, "trajectory": {"harmonics": 3}}
    following = dynid.next_motion(arm, so_far, want, longest_s=200, progress=steps.append, **asked)
    rows = {row["name"]: row for row in following.wanted.rows()}
    assert set(rows) == {"shoulder.fv", "elbow.fc"} and rows["elbow.fc"]["state"] == "holds already", rows
    first = rows["shoulder.fv"]
    assert first["half_width"] == pytest.approx(before["shoulder.fv"], rel=0.5) and first["wanted_half_width"] < first["half_width"]
    assert following.feasible and following.joints == arm.joints and following.q.shape == (len(following.t), 2) and steps
    assert first["half_width_after"] <= first["wanted_half_width"] * 1.001 and first["state"] == "reached", first
    assert "<html" in following.report().lower() and following.status in repr(following)
    none = dynid.next_motion(arm, [so_far], {"elbow.fc": 1e3}, **asked)
    assert not none.feasible and "nothing has to be recorded" in none.headline
    with pytest.raises(dynid.SettingError, match="elbow.fcc"):
        dynid.next_motion(arm, so_far, {"elbow.fcc": 1}, **asked)
    with pytest.raises(dynid.SettingError, match="setting `want`: expected NAME=WIDTH"):
        dynid.next_motion(arm, so_far, {"elbow.fc": "much"}, **asked)


def test_logs_that_may_carry_something_else() -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=5, rate_hz=200, seed=1)
    link = [f"fore.{symbol}" for symbol in "m mx my mz Ixx Ixy Ixz Iyy Iyz Izz".split()]
    factor = dynid.identify(arm, made.log, preferred=link).reduce(made.log, payload="fore")
    assert b'"payload":"fore"' in factor.to_bytes()
    with pytest.raises(dynid.SettingError, match="`preferred`: expected `fore.m`"):
        dynid.identify(arm, made.log).reduce(made.log, payload="fore")
    with pytest.raises(dynid.SettingError, match="expected a moving link: .*found gripper"):
        dynid.identify(arm, made.log, preferred=link).reduce(made.log, payload="gripper")


def test_a_robot_that_runs() -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=60, rate_hz=200, seed=1)
    session = dynid.Online(arm, online={"learn_s": 20})
    events = []
    for k in range(0, len(made.t), 500):
        events += session.feed(made.t[k : k + 500], made.q[k : k + 500], made.tau[k : k + 500])
    events += session.finish()
    kinds = [event["event"] for event in events]
    assert kinds.count("learned") == 1 and kinds.count("estimate") > 10 and "change" not in kinds
    # Row by row the same comes out.
    single = dynid.Online(arm, online={"learn_s": 20})
    rows = [e for t, q, tau in zip(made.t, made.q, made.tau, strict=True) for e in single.feed(t, q, tau)] + single.finish()
    last = [event for event in events if event["event"] == "estimate"][-1]
    assert [event for event in rows if event["event"] == "estimate"][-1] == last
    with pytest.raises(TypeError, match="without `velocity`"):
        session.feed(made.t[:1], made.q[:1], made.tau[:1], made.q[:1])
    with pytest.raises(ValueError, match="q: expected shape"):
        dynid.Online(arm).feed(made.t[:500], made.q[:500].T, made.tau[:500].T)
