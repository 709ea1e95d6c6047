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


def positions(model: Any, q: Array) -> Array:
    """Angles as Pinocchio has them: cosine and sine where a joint turns without end."""
    out = np.zeros((len(q), model.nq))
    for joint in list(model.joints)[1:]:
        x = q[:, joint.idx_v]
        out[:, joint.idx_q : joint.idx_q + joint.nq] = x[:, None] if joint.nq == 1 else np.column_stack([np.cos(x), np.sin(x)])
    return out


def compare(robot: dynid.Robot, model: Any, states: States) -> None:
    """A robot against a model, whose joints may stand in another order."""
    data = model.createData()
    q, v, a = states(model.nv, 50)
    place = [robot.joints.index(name) for name in list(model.names)[1:]]
    back_place = np.argsort(place)
    columns = np.array([10 * k + c for k in back_place for c in range(10)])
    ours_q, ours_v, ours_a = (x[:, back_place] for x in (q, v, a))
    motion = list(zip(positions(model, q), v, a, strict=True))
    tau = np.array([pin.rnea(model, data, *x).copy() for x in motion])
    ours = robot.inverse_dynamics(ours_q, ours_v, ours_a)
    close(ours, tau[:, back_place])
    close(robot.inverse_dynamics(ours_q, ours_v, ours_a, threads=2), ours, 0)
    theirs = np.array([pin.computeJointTorqueRegressor(model, data, *x).copy() for x in motion])
    close(robot.regressor(ours_q, ours_v, ours_a, order="pinocchio"), theirs[:, back_place][:, :, columns])
    weight = np.array([pin.computeGeneralizedGravity(model, data, x).copy() for x, _, _ in motion])
    close(robot.gravity(ours_q), weight[:, back_place])
    # The articulated-body algorithms divide by small inertias: as good as the numbers of Pinocchio's own return.
    back = np.array([pin.aba(model, data, x, y, t).copy() for (x, y, _), t in zip(motion, tau, strict=True)])
    limit = max(1e-10, 10 * np.abs(back - a).max() / np.abs(a).max())
    close(robot.forward_dynamics(ours_q, ours_v, tau[:, back_place]), ours_a, limit)

    def mass(x: Array) -> Array:
        whole = np.triu(pin.crba(model, data, x))
        both: Array = whole + np.triu(whole, 1).T
        return both[np.ix_(back_place, back_place)]

    close(robot.mass_matrix(ours_q), np.array([mass(x) for x, _, _ in motion]))
    full = robot.regressor(ours_q, ours_v, ours_a)
    _, expressions, k = robot.base_parameters()
    close(robot.regressor(ours_q, ours_v, ours_a, base=True) @ k, full, 1e-10)
    assert len(expressions) == len(k)


@pytest.mark.parametrize("name", ["ur5", "ur10", "iiwa14", "panda", "tiago"])
def test_oracle_robots(name: str, states: States) -> None:
    path = shared(f"data/oracles/{name}.urdf")
    model = pin.buildModelFromUrdf(str(path))
    assert not np.any(model.armature)
    compare(dynid.Robot.load(path), model, states)
    again = dynid.Robot.from_pinocchio(model)
    assert again.joints == list(model.names)[1:]
    compare(again, model, states)


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
    compare(robot, model, states)
    with pytest.raises(dynid.UnsupportedError, match="3 degrees of freedom"):
        dynid.Robot.from_pinocchio(sample([pin.JointModelSpherical()]))


def test_turning_without_end_has_an_angle(states: States) -> None:
    model = sample([pin.JointModelRUBZ(), pin.JointModelRX()])
    robot = dynid.Robot.from_pinocchio(model)
    assert robot.nq == 2 and any("angle" in w for w in robot.warnings)
    compare(robot, model, states)


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
