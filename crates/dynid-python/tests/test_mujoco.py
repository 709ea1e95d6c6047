"""Against MuJoCo: models read, identified, put back and rolled out."""

from __future__ import annotations

from typing import Any

import dynid
import numpy as np
import pytest
from conftest import States
from numpy.typing import NDArray

mujoco = pytest.importorskip("mujoco")

Array = NDArray[np.float64]

ARM = """
<mujoco>
  <option gravity="0.3 -0.2 -9.7"/>
  <compiler angle="radian"/>
  <worldbody>
    <body name="post" pos="0.1 0 0.4" euler="0.2 0.1 -0.3">
      <geom type="box" size=".05 .06 .2" mass="5"/>
      <body name="shoulder" pos="0 0.1 0.2" quat="0.9 0.1 0.3 -0.2">
        <joint name="pan" axis="0.1 0.2 1" pos="0.02 0.01 0" ref="0.4" range="-2 2" limited="true"/>
        <joint name="lift" axis="0 1 0.1" pos="0 0.03 0.05" range="-2 2" limited="true"/>
        <geom type="capsule" size=".04 .15" pos="0.03 0 .15" mass="3"/>
        <body name="bracket" pos="0 0 .3" euler="0 .4 0">
          <geom type="box" size=".02 .05 .03" pos=".01 .02 0" mass=".7"/>
          <body name="slider" pos="0 .05 .02">
            <joint name="slide" type="slide" axis="0.2 0 1" ref="0.1" range="-.3 .3" limited="true"/>
            <geom type="box" size=".03 .02 .08" pos="0 .01 .06" mass="1.5"/>
            <body name="hand" pos="0.01 0 .15" euler="0.3 0 0.2">
              <joint name="roll" axis="1 0 0" range="-2 2" limited="true"/>
              <geom type="box" size=".05 .03 .02" pos=".04 .02 .01" mass="1"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def inverse(model: Any, q: Array, v: Array, a: Array) -> Array:
    data, out = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, v, a, strict=True):
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse.copy())
    return np.array(out)


def without_contact(model: Any) -> Any:
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return model


def test_efforts_and_mass_matrices(states: States) -> None:
    model = without_contact(mujoco.MjModel.from_xml_string(ARM))
    robot = dynid.Robot.from_mujoco(model)
    assert robot.joints == ["pan", "lift", "slide", "roll"]
    q, v, a = states(4, 40)
    theirs = inverse(model, q, v, a)
    assert np.abs(robot.inverse_dynamics(q, v, a) - theirs).max() <= 1e-12 * np.abs(theirs).max()
    data, dense = mujoco.MjData(model), np.zeros((4, 4))
    for x, ours in zip(q, robot.mass_matrix(q), strict=True):
        data.qpos[:] = x
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, dense)
        assert np.abs(ours - dense).max() <= 1e-12 * np.abs(dense).max()


def test_what_cannot_be_identified_is_refused() -> None:
    free = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body name="a"><freejoint name="f"/><geom size=".1"/></body></worldbody></mujoco>')
    with pytest.raises(dynid.UnsupportedError, match="free joint") as caught:
        dynid.Robot.from_mujoco(free)
    assert caught.value.hint


def test_joints_that_were_held_are_not_counted_twice() -> None:
    model = mujoco.MjModel.from_xml_string(ARM)
    robot = dynid.Robot.from_mujoco(model)
    made = dynid.simulate(robot, duration_s=20, rate_hz=200, seed=6)
    first = made.joints[:3]
    found = dynid.identify(robot, dynid.Log(made.t, made.q[:, :3], made.tau[:, :3], joints=first))
    masses = model.body_mass.copy()
    with pytest.raises(dynid.UnsupportedError, match="joints roll of the model were held"):
        found.apply(model)
    assert (model.body_mass == masses).all()


def test_what_is_left_out_is_told() -> None:
    for change, told in (
        ('axis="1 0 0" stiffness="3 1"', "`jnt_stiffnesspoly`"),
        ('axis="1 0 0" damping="0.1 0.2"', "`dof_dampingpoly`"),
    ):
        odd = mujoco.MjModel.from_xml_string(ARM.replace('axis="1 0 0"', change, 1))
        with pytest.warns(dynid.DynidWarning, match=told):
            assert any(told in w for w in dynid.Robot.from_mujoco(odd).warnings)
    dense = mujoco.MjModel.from_xml_string(ARM.replace("<option ", '<option density="1.2" '))
    with pytest.warns(dynid.DynidWarning, match="density"):
        dynid.Robot.from_mujoco(dense)


def test_identified_put_back_and_rolled_out() -> None:
    model = without_contact(mujoco.MjModel.from_xml_string(ARM))
    # The machine is not as its model: other masses, and friction.
    real = without_contact(mujoco.MjModel.from_xml_string(ARM))
    real.body_mass[:] *= 1.15
    real.body_inertia[:] *= 1.15
    real.dof_damping[:] = np.reshape([1.0, 2.0, 5.0, 0.3], real.dof_damping.shape)
    real.dof_armature[:] = [0.05, 0.08, 0.4, 0.02]
    mujoco.mj_setConst(real, mujoco.MjData(real))
    robot = dynid.Robot.from_mujoco(model)
    motion = dynid.simulate(robot, duration_s=20, rate_hz=250, seed=5)
    q, v, a = motion.clean_q, motion.clean_v, motion.clean_a
    tau = inverse(real, q, v, a)
    noise = np.random.default_rng(1).normal(size=tau.shape) * 0.005 * tau.std(axis=0)
    log = dynid.Log(motion.t, q, tau + noise, joints=robot.joints)
    found = dynid.identify(robot, log, elements={"default": ["viscous", "rotor"], "friction": "given"})
    back = without_contact(mujoco.MjModel.from_xml_string(ARM))
    assert found.apply(back) == []
    mujoco.mj_setConst(back, mujoco.MjData(back))
    error = np.sqrt(np.mean((inverse(back, q, v, a) - tau) ** 2, axis=0)) / tau.std(axis=0)
    before = np.sqrt(np.mean((inverse(model, q, v, a) - tau) ** 2, axis=0)) / tau.std(axis=0)
    assert (error < 0.002).all() and (before > 0.05).all(), (error, before)
    assert np.abs(inverse(back, q, v, a) - found.predict(q, v, a)).max() < 1e-9 * np.abs(tau).max()

    # Two joints of one body leave a link without mass between them in a robot file.
    with pytest.raises(dynid.DynidError, match="`shoulder__pan` has no mass"):
        found.to_mjcf()

    def end(m: Any) -> Array:
        data = mujoco.MjData(m)
        for _ in range(500):
            data.qfrc_applied[:] = data.qfrc_bias + 0.3 * np.sin(3 * data.time)
            mujoco.mj_step(m, data)
        return np.array(data.qpos)

    ended = end(real)
    assert np.isfinite(end(model)).all()
    assert np.abs(end(back) - ended).max() < 0.02 * np.abs(end(model) - ended).max()
