"""MJCF read without MuJoCo, against MuJoCo: random models of every feature, and files edited in place."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest
from numpy.typing import NDArray
from random_mjcf import Random, write_meshes

mujoco = pytest.importorskip("mujoco")

Array = NDArray[np.float64]

# MuJoCo refers to nothing else here: friction, rotors and springs are looked at by themselves.
PARTS = ("mjDSBL_CONSTRAINT", "mjDSBL_SPRING", "mjDSBL_DAMPER")


def bare(model: Any) -> Any:
    for part in PARTS:
        model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, part))
    model.dof_armature[:] = 0
    return model


def rotation(quaternion: Array) -> Array:
    out = np.zeros(9)
    mujoco.mju_quat2Mat(out, quaternion)
    return out.reshape(3, 3)


def compared(robot: dynid.Robot, model: Any, count: int = 10) -> float:
    """The largest difference of efforts at random states, relative to the largest effort. Rates of a free joint are in axes of its body here, and
    those of its origin in axes of the world there."""
    assert len(robot.joints) == model.nv
    data, rng = mujoco.MjData(model), np.random.default_rng(1)
    theirs, states = [], []
    for _ in range(count):
        data.qvel[:], data.qacc[:] = rng.uniform(-2, 2, model.nv), rng.uniform(-5, 5, model.nv)
        q: list[float] = []
        v, a = data.qvel.copy(), data.qacc.copy()
        free: list[tuple[int, Array]] = []
        for j in range(model.njnt):
            at, dof = int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])
            if model.jnt_type[j] != 0:
                data.qpos[at] = rng.uniform(-3, 3)
                q.append(float(data.qpos[at]))
                continue
            unit = rng.normal(size=4)
            unit /= np.linalg.norm(unit)
            data.qpos[at : at + 3], data.qpos[at + 3 : at + 7] = rng.uniform(-1, 1, 3), unit
            q += [*data.qpos[at : at + 3], *unit[1:], unit[0]]
            turned = rotation(unit)
            v[dof : dof + 3] = turned.T @ v[dof : dof + 3]
            a[dof : dof + 3] = turned.T @ a[dof : dof + 3] - np.cross(v[dof + 3 : dof + 6], v[dof : dof + 3])
            free.append((dof, turned))
        mujoco.mj_inverse(model, data)
        effort = data.qfrc_inverse.copy()
        for dof, turned in free:
            effort[dof : dof + 3] = turned.T @ effort[dof : dof + 3]
        theirs.append(effort)
        states.append((q, v, a))
    ours = robot.inverse_dynamics(*(np.array(part) for part in zip(*states, strict=True)))
    return float(np.abs(ours - np.array(theirs)).max() / np.abs(theirs).max())


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_random_models_have_the_efforts_of_mujoco(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # MuJoCo writes a file of its warnings where it runs.
    monkeypatch.chdir(tmp_path)
    write_meshes(tmp_path)
    file = tmp_path / "model.xml"
    file.write_text(Random(seed).text(), encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(file))
    assert compared(dynid.Robot.load(file), bare(model)) < 1e-10


ARM = """<!-- of the workshop -->
<mujoco model="arm">
  <compiler angle="radian" inertiafromgeom="true"/>
  <default><joint damping="0.5" armature="0.1"/></default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="post" pos="0.1 0 0.4" euler="0.2 0.1 -0.3">
      <geom type="box" size=".05 .06 .2" mass="5"/>
      <include file="upper.xml"/>
    </body>
  </worldbody>
</mujoco>
"""
UPPER = """<mujocoinclude>
  <body name="shoulder" pos="0 0.1 0.2" quat="0.9 0.1 0.3 -0.2">
    <joint name="pan" axis="0.1 0.2 1" pos="0.02 0.01 0" ref="0.4" range="-2 2"/>
    <joint name="lift" axis="0 1 0.1" pos="0 0.03 0.05" range="-2 2" frictionloss="0.3"/>
    <geom type="capsule" size=".04 .15" pos="0.03 0 .15" mass="3"/>  <!-- steel -->
    <body name="hand" pos="0.01 0 .3" euler="0.3 0 0.2">
      <joint name="slide" type="slide" axis="0.2 0 1" range="-.3 .3"/>
      <inertial pos="0 0 0" mass="9" diaginertia="1 1 1"/>
      <geom type="box" size=".05 .03 .02" pos=".04 .02 .01" mass="1"/>
    </body>
  </body>
</mujocoinclude>
"""


@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
@pytest.mark.parametrize("angle", ["degree", "radian"])
def test_springs_are_identified_and_put_back(angle: str, tmp_path: Path) -> None:
    """A hinge and a slide with springs that are not as the model has them: read from the file and from MuJoCo's model, and written into both."""
    rest = "-20" if angle == "degree" else repr(float(np.radians(-20)))
    text = f"""
<mujoco><compiler angle="{angle}"/><worldbody><body name="a"><joint name="turn" axis="0 1 0" stiffness="5" springref="{rest}" ref="0.1"/>
  <geom type="capsule" size=".04 .15" pos="0.1 0 .15" mass="3"/>
  <body name="b" pos="0 0 .3"><joint name="slide" type="slide" axis="0 0 1" stiffness="40" springref="0.02" damping="1"/>
  <geom type="box" size=".05 .04 .06" mass="1"/></body></body></worldbody></mujoco>"""
    (tmp_path / "arm.xml").write_text(text, encoding="utf-8")
    robot = dynid.Robot.load(tmp_path / "arm.xml")
    assert any("spring (5 around -0.349" in w for w in robot.warnings)

    def efforts(model: Any, q: Any, v: Any, a: Any) -> Any:
        data, tau = mujoco.MjData(model), []
        for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, v, a, strict=True):
            mujoco.mj_inverse(model, data)
            tau.append(data.qfrc_inverse.copy())
        return np.array(tau)

    def plain(path: Path) -> Any:
        model = mujoco.MjModel.from_xml_path(str(path))
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        return model

    real = plain(tmp_path / "arm.xml")
    real.jnt_stiffness[:] = [8.0, 30.0]
    real.qpos_spring[:] = [0.4, -0.05]
    motion = dynid.simulate(robot, duration_s=30, rate_hz=200, seed=5)
    q, v, a = motion.clean_q, motion.clean_v, motion.clean_a
    tau = efforts(real, q, v, a)
    for made in (robot, dynid.Robot.from_mujoco(mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml")))):
        found = dynid.identify(made, dynid.Log(motion.t, q, tau, joints=made.joints), elements={"default": ["viscous"], "friction": "given"})
        value = {p["name"]: p["value"] for p in json.loads(found.to_json())["parameters"]}
        assert value["turn.k"] == pytest.approx(8.0, rel=1e-3) and value["slide.k"] == pytest.approx(30.0, rel=1e-3)
        back = plain(tmp_path / "arm.xml")
        found.apply(back)
        mujoco.mj_setConst(back, mujoco.MjData(back))
        out = tmp_path / f"{made.name}.out.xml"
        found.to_mjcf(out)
        ours = found.predict(q, v, a)
        for model in (back, plain(out)) if made is robot else (back,):
            assert model.qpos_spring == pytest.approx([0.4, -0.05], abs=2e-3)
            theirs = efforts(model, q, v, a)
            assert np.abs(ours - theirs).max() < 1e-12 * np.abs(theirs).max()
            assert np.abs(tau - theirs).max() < 1e-3 * np.abs(tau).max()

    # A spring at a joint that stands still pulls at it all the same: its effort is no part of what the masses weigh.
    still = q * [1, 0] + [0, 0.3]
    as_stated = plain(tmp_path / "arm.xml")
    tau = efforts(as_stated, still, v * [1, 0], a * [1, 0])
    found = dynid.identify(robot, dynid.Log(motion.t, still, tau, joints=robot.joints), elements={"default": ["viscous"], "friction": "given"})
    other, at_rest = q[::-1] * [-0.5, 0] + [0.2, 0.3], np.zeros_like(q)
    theirs = efforts(as_stated, other, at_rest, at_rest)
    assert np.abs(found.predict(other, at_rest, at_rest) - theirs).max() < 1e-3 * np.abs(theirs).max()


@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_identified_values_go_into_the_own_files(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    (tmp_path / "upper.xml").write_text(UPPER, encoding="utf-8")
    robot = dynid.Robot.load(tmp_path / "arm.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    assert compared(robot, bare(model)) < 1e-12
    assert robot.joints == ["pan", "lift", "slide"]
    real = bare(mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml")))
    real.body_mass[:] *= 1.2
    real.body_inertia[:] *= 1.2
    real.dof_armature[:] = [0.2, 0.3, 0.5]
    mujoco.mj_setConst(real, mujoco.MjData(real))
    motion = dynid.simulate(robot, duration_s=20, rate_hz=200, seed=5)
    q, v, a = motion.clean_q, motion.clean_v, motion.clean_a
    data, tau = mujoco.MjData(real), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, v, a, strict=True):
        mujoco.mj_inverse(real, data)
        tau.append(data.qfrc_inverse + np.array([1.0, 2.0, 5.0]) * data.qvel)
    log = dynid.Log(motion.t, q, np.array(tau), joints=robot.joints)
    found = dynid.identify(robot, log, elements={"default": ["viscous", "rotor"], "friction": "given"})

    out = tmp_path / "out"
    out.mkdir()
    with pytest.raises(ValueError, match=r"upper\.xml"):
        found.to_mjcf()
    found.to_mjcf(out / "arm.xml")
    # What was not asked for stays as it was, line by line.
    assert (out / "arm.xml").read_text(encoding="utf-8") == ARM.replace('inertiafromgeom="true"', 'inertiafromgeom="auto"')
    plain = re.compile(r'\n *<inertial [^>]*/>| (?:damping|armature|frictionloss)="[^"]*"')
    assert plain.sub("", (out / "upper.xml").read_text(encoding="utf-8")) == plain.sub("", UPPER)

    edited = mujoco.MjModel.from_xml_path(str(out / "arm.xml"))
    assert np.abs(edited.dof_frictionloss).max() == 0
    mujoco.mj_setConst(edited, mujoco.MjData(edited))
    edited.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, theirs = mujoco.MjData(edited), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, v, a, strict=True):
        mujoco.mj_inverse(edited, data)
        theirs.append(data.qfrc_inverse.copy())
    ours = found.predict(q, v, a)
    assert np.abs(ours - np.array(theirs)).max() < 1e-12 * np.abs(theirs).max()
    assert np.abs(np.array(tau) - np.array(theirs)).max() < 0.01 * np.abs(tau).max()
    assert compared(dynid.Robot.load(out / "arm.xml"), bare(edited)) < 1e-12


def test_what_cannot_be_carried_is_refused_and_the_rest_told() -> None:
    text = '<mujoco><worldbody><body name="a"><joint name="j" {}/><geom size=".1"/></body></worldbody></mujoco>'
    with pytest.raises(dynid.RobotError, match="ball joint") as caught:
        dynid.Robot.parse(text.format('type="ball"'), "m.xml")
    assert caught.value.hint
    with pytest.warns(dynid.DynidWarning, match="its spring"):
        dynid.Robot.parse(text.format('stiffness="3"'), "m.xml")
