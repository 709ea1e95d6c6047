"""Against iDynTree: efforts and regressors, column by column."""

from __future__ import annotations

import dynid
import numpy as np
import pytest
from conftest import States, shared

idyntree = pytest.importorskip("idyntree.bindings")


@pytest.mark.parametrize("name", ["ur5", "ur10"])
def test_oracle_robots(name: str, states: States) -> None:
    path = shared(f"data/oracles/{name}.urdf")
    robot = dynid.Robot.load(path)
    loader, kinematics = idyntree.ModelLoader(), idyntree.KinDynComputations()
    assert loader.loadReducedModelFromFile(str(path), robot.joints) and kinematics.loadRobotModel(loader.model())
    model = kinematics.model()
    gravity, rest = idyntree.Vector3(), idyntree.Vector6()
    gravity.zero()
    gravity.setVal(2, -9.81)
    rest.zero()
    q, v, a = states(robot.nv, 20)
    links = [model.getLinkName(k) for k in range(model.getNrOfLinks())]
    columns = [10 * links.index(link) + k for link in robot.links for k in range(10)]
    efforts, rows = [], []
    for state in zip(q, v, a, strict=True):
        position, velocity, acceleration = (idyntree.VectorDynSize.FromPython(list(x)) for x in state)
        kinematics.setRobotState(position, velocity, gravity)
        wrenches, torques = idyntree.LinkWrenches(model), idyntree.FreeFloatingGeneralizedTorques(model)
        wrenches.zero()
        kinematics.inverseDynamics(rest, acceleration, wrenches, torques)
        efforts.append(torques.jointTorques().toNumPy().copy())
        regressor = idyntree.MatrixDynSize()
        kinematics.inverseDynamicsInertialParametersRegressor(rest, acceleration, regressor)
        rows.append(regressor.toNumPy()[6:, columns].copy())
    for ours, theirs in ((robot.inverse_dynamics(q, v, a), efforts), (robot.regressor(q, v, a), rows)):
        assert np.abs(ours - np.array(theirs)).max() <= 1e-12 * np.abs(theirs).max()
