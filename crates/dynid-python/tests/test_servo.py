"""Drives from commands and positions: logs that MuJoCo made, and MuJoCo with what was found."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest

PROGRAM = [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())"]
PERIOD = 0.005
STEP = 2 * np.pi / 4096
DELAY = 2 * PERIOD

# kp, kv, armature, damping, frictionloss of shoulder and elbow.
TRUTH = {"shoulder": (40.0, 1.5, 0.02, 0.3, 0.4), "elbow": (25.0, 1.0, 0.01, 0.15, 0.2)}


def arm(found: dict[str, tuple[float, float, float]] | None = None) -> str:
    """The arm with friction and rotors, or without for the identification."""

    def joint(name: str) -> str:
        armature, damping, loss = found[name] if found else (0.0, 0.0, 0.0)
        return (
            f'<joint name="{name}" type="hinge" axis="0 1 0" armature="{armature}" damping="{damping}" '
            f'frictionloss="{loss}" solreffriction="0.001 1"/>'
        )

    return f"""<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="implicitfast" iterations="200"/>
  <worldbody>
    <body name="upper">
      <inertial pos="0.15 0 0" mass="1.2" diaginertia="0.001 0.01 0.01"/>
      {joint("shoulder")}
      <body name="fore" pos="0.3 0 0">
        <inertial pos="0.12 0 0" mass="0.8" diaginertia="0.001 0.005 0.005"/>
        {joint("elbow")}
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def commands(rows: int, seed: int) -> np.ndarray[Any, Any]:
    random = np.random.default_rng(seed)
    t = np.arange(rows) * PERIOD
    waves = [0.4 / (1 + 1.5 * f) * np.sin(2 * np.pi * f * t[:, None] + random.uniform(0, 6, 2)) for f in (0.2, 0.6, 1.5, 3.7)]
    command: np.ndarray[Any, Any] = np.sum(waves, axis=0) + np.array([0.5, 0.4])
    command[rows // 2 : rows // 2 + 200] = command[rows // 2]
    return command


def rollout(mujoco: Any, model: Any, command: np.ndarray[Any, Any], late: float, force: Any = None) -> np.ndarray[Any, Any]:
    """Positions of a model along held commands that come `late`; `force`: effort from command, q, v where there is no actuator."""
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    out = np.empty_like(command)
    inner = round(PERIOD / model.opt.timestep)
    for row in range(len(command)):
        out[row] = data.qpos
        for k in range(inner):
            at = row + (k * model.opt.timestep - late) / PERIOD
            told = command[max(0, int(np.floor(at + 1e-9)))]
            if force is None:
                data.ctrl[:] = told
            else:
                data.qfrc_applied[:] = force(told, data.qpos, data.qvel)
            mujoco.mj_step(model, data)
    return out


@pytest.mark.parametrize("seed", [1, 2])
def test_drives_of_a_mujoco_arm_are_found_and_put_back(tmp_path: Path, seed: int) -> None:
    mujoco = pytest.importorskip("mujoco")
    names = list(TRUTH)
    truth = mujoco.MjModel.from_xml_string(arm({n: TRUTH[n][2:] for n in names}))
    kp, kv = (np.array([TRUTH[n][k] for n in names]) for k in (0, 1))
    command = commands(3000, seed)
    exact = rollout(mujoco, truth, command, DELAY, lambda u, q, v: kp * (u - q) - kv * v)
    position = np.round(exact / STEP) * STEP
    (tmp_path / "arm.xml").write_text(arm())
    head = ",".join(["t", *(f"cmd_{n}" for n in names), *(f"q_{n}" for n in names)])
    table = np.column_stack([np.arange(len(command)) * PERIOD, command, position])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    (tmp_path / "servo.toml").write_text(
        'robot = "arm.xml"\n[[log]]\npath = "log.csv"\n[servo]\ngains = "own"\nvelocity_gain = { shoulder = 1.5, elbow = 1.0 }\n'
        "law = []\n"
    )
    ended = subprocess.run(
        [*PROGRAM, "servo", "servo.toml", "--out", "out"], cwd=tmp_path, capture_output=True, check=False
    )
    assert ended.returncode == 0, ended.stderr.decode()
    record = json.loads((tmp_path / "out/servo.json").read_text())
    place = {"position_gain": 0, "rotor_inertia": 2, "viscous": 3, "coulomb": 4}
    # MuJoCo's friction gives way a little, which no law here has: values may be off by more than the encoder tells.
    within = {"position_gain": 0.01, "rotor_inertia": 0.05, "viscous": 0.05, "coulomb": 0.03}
    for p in record["parameters"]:
        if p["term"] == "delay":
            assert abs(p["value"] - DELAY) < 5e-4, p
            continue
        true = TRUTH[p["joints"][0]][place[p["term"]]]
        assert abs(p["value"] / true - 1) < within[p["term"]], p
    assert record["fit"]["misfit"] < 1.5, record["fit"]

    # The user's own model with what was found, driven by the actuators that were written.
    edited = (tmp_path / "out/arm.xml").read_text()
    actuators = (tmp_path / "out/actuators.xml").read_text()
    inner = actuators[actuators.index("<actuator>") : actuators.index("</actuator>") + len("</actuator>")]
    back = mujoco.MjModel.from_xml_string(edited.replace("</mujoco>", inner + "</mujoco>"))
    delay = next(p["value"] for p in record["parameters"] if p["term"] == "delay")
    driven = rollout(mujoco, back, command, delay)
    error = np.sqrt(np.mean((driven - exact)[100:] ** 2))
    assert error < 0.5e-3, f"{error} rad"
    # And by MuJoCo's own parser the file that is included.
    (tmp_path / "out/whole.xml").write_text(edited.replace("</mujoco>", '<include file="actuators.xml"/></mujoco>'))
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out/whole.xml")).nu == 2


def test_gears_that_give_way_are_found_and_put_back(tmp_path: Path) -> None:
    """Links behind springs with backlash: MuJoCo with a spring of its own is the truth, and the file that is written goes along with it."""
    mujoco = pytest.importorskip("mujoco")
    names = list(TRUTH)
    kp, kv = (np.array([TRUTH[n][k] for n in names]) for k in (0, 1))
    stiffness, damping, half = np.array([250.0, 60.0]), np.array([0.5, 0.05]), np.array([2e-3, 3e-3])

    def carry(_: Any, data: Any) -> None:
        lead, rate = -data.qpos[1::2], -data.qvel[1::2]
        touches = np.abs(lead) >= half
        data.qfrc_passive[1::2] += np.where(touches, stiffness * (lead - np.sign(lead) * half) + damping * rate, 0.0)

    text = arm({n: TRUTH[n][2:] for n in names})
    text = text.replace('timestep="0.0005" integrator="implicitfast"', 'timestep="0.00025" integrator="RK4"')
    text = text.replace('solreffriction="0.001 1"', 'solreffriction="0.0004 1" solimpfriction="0.9999 0.9999 0.001"')
    for name in names:
        end = text.index("/>", text.index(f'<joint name="{name}"')) + 2
        text = f'{text[:end]}<joint name="{name}_soft" axis="0 1 0"/>{text[end:]}'
    truth = mujoco.MjModel.from_xml_string(text)
    command = commands(2000, 3)
    motors = [0, 2]

    def record(model: Any, force: Any) -> np.ndarray[Any, Any]:
        """Motors along held commands, from rest."""
        data = mujoco.MjData(model)
        data.qpos[motors] = command[0]
        inner = round(PERIOD / model.opt.timestep)
        rows = []
        for k in range(-300 * inner, len(command) * inner):
            if k >= 0 and k % inner == 0:
                rows.append(data.qpos[motors].copy())
            told = command[max(0, k - round(DELAY / model.opt.timestep)) // inner]
            force(data, told)
            mujoco.mj_step(model, data)
        return np.array(rows)

    def push(data: Any, told: np.ndarray[Any, Any]) -> None:
        data.qfrc_applied[motors] = kp * (told - data.qpos[motors]) - kv * data.qvel[motors]

    mujoco.set_mjcb_passive(carry)
    try:
        exact = record(truth, push)
    finally:
        mujoco.set_mjcb_passive(None)
    # The user's model has a pose, which counts coordinates.
    plain = arm().replace("</mujoco>", '<keyframe><key name="up" qpos="0.1 0.2"/></keyframe></mujoco>')
    (tmp_path / "arm.xml").write_text(plain)
    head = ",".join(["t", *(f"cmd_{n}" for n in names), *(f"q_{n}" for n in names)])
    position = np.round(exact / STEP) * STEP
    table = np.column_stack([np.arange(len(command)) * PERIOD, command, position])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    (tmp_path / "servo.toml").write_text(
        'robot = "arm.xml"\n[[log]]\npath = "log.csv"\n[servo]\ngains = "own"\nvelocity_gain = { shoulder = 1.5, elbow = 1.0 }\n'
        'law = []\nfind = ["compliance", "gear_damping", "backlash"]\n'
    )
    ended = subprocess.run([*PROGRAM, "servo", "servo.toml", "--out", "out"], cwd=tmp_path, capture_output=True, check=False)
    assert ended.returncode == 0, ended.stderr.decode()
    found = json.loads((tmp_path / "out/servo.json").read_text())
    assert found["fit"]["misfit"] < 1.1, found["fit"]
    for p in found["parameters"]:
        true = {"compliance": 1 / stiffness, "backlash": 2 * half}.get(p["term"])
        if true is not None:
            k = names.index(p["joints"][0])
            assert p["interval"][0] <= true[k] <= p["interval"][1], p
            assert abs(p["value"] / true[k] - 1) < 0.1, p

    actuators = (tmp_path / "out/actuators.xml").read_text()
    inner = actuators[actuators.index("<actuator>") : actuators.index("</actuator>") + len("</actuator>")]
    back = mujoco.MjModel.from_xml_string((tmp_path / "out/arm.xml").read_text().replace("</mujoco>", inner + "</mujoco>"))
    assert [back.joint(k).name for k in range(back.njnt)] == ["shoulder", "shoulder_gear", "elbow", "elbow_gear"]
    assert back.key_qpos.tolist() == [[0.1, 0.0, 0.2, 0.0]]
    driven = record(back, lambda data, told: data.ctrl.__setitem__(slice(None), told))
    error = np.sqrt(np.mean((driven - exact) ** 2))
    # Below the rounding of the encoders.
    assert error < STEP / np.sqrt(12), f"{error} rad"


ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.15 0 0"/><mass value="1.2"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.12 0 0"/><mass value="0.8"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.005"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="60" velocity="6"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="60" velocity="6"/></joint>
</robot>
"""


def moved(
    mujoco: Any, command: np.ndarray[Any, Any], period: float, efforts: list[np.ndarray[Any, Any]] | None = None
) -> np.ndarray[Any, Any]:
    """What encoders read of the true arm in MuJoCo, by Runge-Kutta steps and dry friction that hardly gives way; `efforts` takes those of the drives."""
    text = arm({joint: values[2:] for joint, values in TRUTH.items()})
    text = text.replace('timestep="0.0005" integrator="implicitfast"', 'timestep="0.0001" integrator="RK4"')
    text = text.replace('solreffriction="0.001 1"', 'solreffriction="0.0004 1" solimpfriction="0.9999 0.9999 0.001"')
    drives = "".join(
        f'<general joint="{joint}" biastype="affine" gainprm="{kp}" biasprm="0 -{kp} -{kv}"/>' for joint, (kp, kv, *_) in TRUTH.items()
    )
    model = mujoco.MjModel.from_xml_string(text.replace("</mujoco>", f"<actuator>{drives}</actuator></mujoco>"))
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    mujoco.mj_forward(model, data)
    ticks, late = round(period / 1e-4), round(DELAY / 1e-4)
    rows = []
    for k in range(len(command) * ticks):
        if k % ticks == 0:
            rows.append(np.round(data.qpos / STEP) * STEP)
        data.ctrl[:] = command[max(0, k - late) // ticks]
        if efforts is not None and k % ticks == 0:
            mujoco.mj_forward(model, data)
            efforts.append(data.qfrc_actuator.copy())
        mujoco.mj_step(model, data)
    return np.array(rows)


def test_arrays_give_drives_and_drives_the_next_motion(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = dynid.Robot.parse(ARM, "arm.urdf")
    command = commands(1600, 3)
    t = np.arange(1600) * PERIOD
    log = dynid.CommandLog(t, command, moved(mujoco, command, PERIOD), name="first log")
    steps: list[str] = []
    gains: dict[str, Any] = {"velocity_gain": {joint: values[1] for joint, values in TRUTH.items()}, "gains": "own"}
    first = dynid.servo(robot, log, progress=steps.append, **gains)
    assert first.status in ("pass", "warn") and steps, first
    assert first.joints == ["shoulder", "elbow"] and first.record["fit"]["by_log"][0]["log"] == "first_log.npz"
    place = {"position_gain": 0, "rotor_inertia": 2, "viscous": 3, "coulomb": 4}

    def errors(found: dynid.Servo) -> dict[tuple[str, str], float]:
        out = {}
        for p in found.parameters.rows():
            true = DELAY if p["term"] == "delay" else TRUTH[p["joints"].split(", ")[0]][place[p["term"]]]
            out[p["term"], p["joints"]] = abs(p["value"] / true - 1)
        return out

    assert max(errors(first).values()) < 0.05, errors(first)

    # The same by files and the command line: the same bytes but for names of files.
    rows = np.column_stack([t, command, log.signals["q"]])
    head = "t,cmd_shoulder,cmd_elbow,q_shoulder,q_elbow"
    np.savetxt(tmp_path / "first.csv", rows, delimiter=",", header=head, comments="", fmt="%.17g")
    of_file = dynid.servo(robot, tmp_path / "first.csv", **gains)
    assert of_file.record["parameters"] == first.record["parameters"]
    backwards = dynid.CommandLog(t, command[:, ::-1], log.signals["q"][:, ::-1], joints=["elbow", "shoulder"])
    assert dynid.servo(robot, backwards, **gains).record["parameters"] == first.record["parameters"]

    again = pickle.loads(pickle.dumps(first))
    assert again.to_json() == first.to_json() and "</html>" in again.report()
    first.save(tmp_path / "out")
    assert {"servo.json", "report.html", "robot.urdf", "actuators.json"} <= {p.name for p in (tmp_path / "out").iterdir()}

    wanted: dict[str, Any] = {
        "limits": {"velocity": 4, "acceleration": 30},
        "safety": {"floor": False, "self_collision": False},
        "search": {"starts": 2},
    }
    made = dynid.design(robot, drives=first, **wanted)
    assert made.feasible and made.commands is not None, made
    assert made.commands.shape == (1001, 2) and np.abs(made.commands).max() <= 2
    by_file = dynid.design(robot, drives=str(tmp_path / "out/servo.json"), **wanted)
    assert by_file.commands is not None and np.array_equal(made.commands, by_file.commands)
    reading = moved(mujoco, made.commands, 0.01)
    assert np.abs(reading).max() < 2.05
    second = dynid.servo(robot, dynid.CommandLog(made.t, made.commands, reading), validation=log, **gains)
    found = errors(second)
    assert np.exp(np.mean(np.log([max(x, 1e-5) for x in found.values()]))) < 0.005, found
    assert second.record["validation"][0]["rms"][0] < 1e-3

    # Beside positions the drives' efforts in one log and their currents in another; no velocity gain is known.
    efforts: list[np.ndarray[Any, Any]] = []
    q = moved(mujoco, command, PERIOD, efforts)
    noise = np.random.default_rng(0).normal(size=(2, *q.shape))
    with_tau = dynid.CommandLog(t, command, q, tau=np.array(efforts) + 0.1 * noise[0])
    with_current = dynid.CommandLog(t, command, q, current=np.array(efforts) / 2 + 0.05 * noise[1])
    logs = [with_tau, with_current, log]
    measured = dynid.servo(robot, logs, gains="own")
    said = {(e["channel"], e["joint"]): e["verdict"] for e in measured.record["fit"]["efforts"]}
    assert said == {(c, j): "taken" for c in ("effort", "current") for j in TRUTH}, said
    value = {(p["term"], p["joints"]): p["value"] for p in measured.parameters.rows()}
    for joint, values in TRUTH.items():
        assert abs(value["position_gain", joint] / values[0] - 1) < 0.02, value
        assert abs(value["velocity_gain", joint] / values[1] - 1) < 0.02, value
        assert abs(value["torque_constant", joint] / 2 - 1) < 0.02, value
    alone = dynid.servo(robot, logs[0], gains="own", fit=[])
    assert alone.record["fit"]["efforts"] == []

    # A spring is no part of a drive.
    model = mujoco.MjModel.from_xml_string(ARM)
    model.jnt_stiffness[1] = 0.5
    assert any("a drive has no spring: those of `elbow`" in w for w in dynid.servo(dynid.Robot.from_mujoco(model), log, **gains).warnings)

    with pytest.raises(dynid.SettingError):
        dynid.servo(robot, log, position_gan=3)
    with pytest.raises(ValueError, match="shape"):
        dynid.CommandLog(t, command, command[:-1])
    with pytest.raises(ValueError, match="wrist"):
        dynid.servo(robot, dynid.CommandLog(t, command, command, joints=["shoulder", "wrist"]))
