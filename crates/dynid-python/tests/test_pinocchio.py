"""Against Pinocchio: efforts, regressors, mass matrices, and models there and back."""

from __future__ import annotations

from typing import Any

import dynid
import numpy as np
import pytest
from conftest import States, shared
from numpy.typing import NDArray

pin = pytest.importorskip("pinocchio")

Array = NDArray[np.float64]


def close(ours: Array, theirs: Array, tolerance: float = 1e-12) -> None:
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).max() <= tolerance * np.abs(theirs).max()


def compare(robot: dynid.Robot, model: Any, q: Array, v: Array, a: Array) -> None:
    data = model.createData()
    close(robot.inverse_dynamics(q, v, a), np.array([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)]))
    close(robot.inverse_dynamics(q, v, a, threads=2), robot.inverse_dynamics(q, v, a), 0)
    theirs = np.array([pin.computeJointTorqueRegressor(model, data, *x).copy() for x in zip(q, v, a, strict=True)])
    close(robot.regressor(q, v, a, order="pinocchio"), theirs)
    close(robot.gravity(q), np.array([pin.computeGeneralizedGravity(model, data, x).copy() for x in q]))
    tau = robot.inverse_dynamics(q, v, a)
    # The articulated-body algorithms divide by small inertias: as good as the numbers of Pinocchio's own return.
    back = np.array([pin.aba(model, data, *x).copy() for x in zip(q, v, tau, strict=True)])
    close(robot.forward_dynamics(q, v, tau), a, max(1e-10, 10 * np.abs(back - a).max() / np.abs(a).max()))

    def mass(x: Array) -> Array:
        whole = np.triu(pin.crba(model, data, x))
        both: Array = whole + np.triu(whole, 1).T
        return both

    close(robot.mass_matrix(q), np.array([mass(x) for x in q]))
    full, expressions, k = robot.regressor(q, v, a), robot.base_parameters()[1], robot.base_parameters()[2]
    close(robot.regressor(q, v, a, base=True) @ k, full, 1e-10)
    assert len(expressions) == len(k)


@pytest.mark.parametrize("name", ["ur5", "ur10", "iiwa14", "panda", "tiago"])
def test_oracle_robots(name: str, states: States) -> None:
    path = shared(f"data/oracles/{name}.urdf")
    model = pin.buildModelFromUrdf(str(path))
    robot = dynid.Robot.load(path)
    if model.nq == model.nv and list(model.names[1:]) == robot.joints:
        compare(robot, model, *states(model.nv, 50))
    again = dynid.Robot.from_pinocchio(model)
    assert again.joints == list(model.names[1:])
    if model.nq == model.nv:
        compare(again, model, *states(model.nv, 50))


def sample(kinds: list[Any]) -> Any:
    """A chain with joints of given kinds and bodies without symmetry."""
    rng = np.random.default_rng(3)
    model, parent = pin.Model(), 0
    for k, kind in enumerate(kinds):
        placement = pin.SE3(pin.rpy.rpyToMatrix(rng.uniform(-3, 3, 3)), rng.uniform(-0.5, 0.5, 3))
        parent = model.addJoint(parent, kind, placement, f"j{k}")
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Identity())
        model.addJointFrame(parent)
        model.addBodyFrame(f"b{k}", parent, pin.SE3.Identity(), model.getFrameId(f"j{k}"))
    return model


def test_joints_of_all_kinds(states: States) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    kinds = [
        pin.JointModelRX(),
        pin.JointModelPY(),
        pin.JointModelRevoluteUnaligned(axis),
        pin.JointModelPrismaticUnaligned(axis),
        pin.JointModelRZ(),
    ]
    model = sample(kinds)
    model.armature = np.zeros(model.nv)
    robot = dynid.Robot.from_pinocchio(model)
    assert robot.links == [f"b{k}" for k in range(5)]
    compare(robot, model, *states(model.nv, 50))
    with pytest.raises(dynid.UnsupportedError, match="3 degrees of freedom"):
        dynid.Robot.from_pinocchio(sample([pin.JointModelSpherical()]))


def test_turning_without_end_has_an_angle(states: States) -> None:
    model = sample([pin.JointModelRUBZ(), pin.JointModelRX()])
    robot = dynid.Robot.from_pinocchio(model)
    assert robot.nq == 2 and any("angle" in w for w in robot.warnings)
    q, v, a = states(2, 20)
    data = model.createData()
    circle = np.column_stack([np.cos(q[:, 0]), np.sin(q[:, 0]), q[:, 1]])
    close(robot.inverse_dynamics(q, v, a), np.array([pin.rnea(model, data, *x) for x in zip(circle, v, a, strict=True)]))


def test_identified_values_go_back() -> None:
    model = pin.buildSampleModelManipulator()
    robot = dynid.Robot.from_pinocchio(model)
    made = dynid.simulate(robot, duration_s=20, rate_hz=200, seed=4)
    found = dynid.identify(robot, made.log)
    there = model.copy()
    told = found.apply(there)
    data = there.createData()
    q, v, a = made.clean_q[::50], made.clean_v[::50], made.clean_a[::50]
    tau = np.array([pin.rnea(there, data, *x).copy() for x in zip(q, v, a, strict=True)])
    tau += v * np.array(there.damping) + np.sign(v) * np.array(there.upperDryFrictionLimit)
    # Offsets have no place there, which is told.
    offsets = {p["joint"]: p["value"] for p in found.record["parameters"] if p["name"].endswith(".fo")}
    tau += np.array([offsets.get(joint, 0.0) for joint in found.joints])
    close(tau, found.predict(q, v, a), 1e-9)
    assert all("no place" in line for line in told)
    read = pin.buildModelFromXML(found.to_urdf())
    data = read.createData()
    bodies = np.array([pin.rnea(read, data, *x).copy() for x in zip(q, v, a, strict=True)])
    close(bodies, np.array([pin.rnea(there, there.createData(), *x).copy() for x in zip(q, v, a, strict=True)]) - a * np.array(there.armature), 1e-9)
    with pytest.raises(KeyError, match="no link called"):
        found.apply(sample([pin.JointModelRX()]))
