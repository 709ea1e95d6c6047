"""Compares exported robot files with an estimate, through Pinocchio and MuJoCo.

Argument: a folder with estimate.json, states.csv (q_<joint>, dq_<joint>, ddq_<joint>), effort.csv (the estimate's own
prediction at these states), robot.urdf and robot.xml. Prints one line of JSON: the largest difference of effort, joint
by joint relative to the largest effort, per file and library; or the reason why a library refuses a file.
"""

import csv
import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import pinocchio

folder = Path(sys.argv[1])
estimate = json.loads((folder / "estimate.json").read_text())
joints = estimate["joints"]
gravity = np.array(estimate["model"]["gravity"])
value = {p["name"]: p["value"] for p in estimate["parameters"]}


def columns(name):
    with open(folder / name, newline="") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], np.array(rows[1:], dtype=float).T))


states, effort = columns("states.csv"), columns("effort.csv")
q, dq, ddq = (np.array([states[f"{s}_{j}"] for j in joints]).T for s in ("q", "dq", "ddq"))
full = np.array([effort[f"effort_{j}"] for j in joints]).T


def parameter(symbol):
    return np.array([value.get(f"{j}.{symbol}", 0.0) for j in joints])


# What no format has a place for, and negative values, which are written as 0.
without = full - parameter("fo") - np.minimum(parameter("fc"), 0.0) * np.sign(dq) - np.minimum(parameter("fv"), 0.0) * dq
in_mjcf = without - np.minimum(parameter("Ia"), 0.0) * ddq
in_urdf = without - parameter("Ia") * ddq


def difference(found, expected):
    return float(np.max(np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected), axis=0)))


def with_pinocchio(path):
    model = pinocchio.buildModelFromUrdf(str(path))
    model.gravity.linear = gravity
    data = model.createData()
    stated = {}
    for joint in ElementTree.parse(path).getroot().findall("joint"):
        dynamics = joint.find("dynamics")
        get = (lambda key: 0.0) if dynamics is None else (lambda key: float(dynamics.get(key, 0.0)))
        stated[joint.get("name")] = (get("damping"), get("friction"))
    damping, friction = np.array([stated[j] for j in joints]).T
    own = [model.joints[model.getJointId(j)] for j in joints]
    found = []
    for row in range(len(q)):
        position, rate, acceleration = pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for k, joint in enumerate(own):
            position[joint.idx_q] = q[row, k]
            if joint.nq == 2:
                position[joint.idx_q : joint.idx_q + 2] = np.cos(q[row, k]), np.sin(q[row, k])
            rate[joint.idx_v], acceleration[joint.idx_v] = dq[row, k], ddq[row, k]
        # The array that rnea returns is overwritten by the next call.
        torque = pinocchio.rnea(model, data, position, rate, acceleration).copy()
        found.append([torque[joint.idx_v] for joint in own])
    return np.array(found) + damping * dq + friction * np.sign(dq)


def with_mujoco(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    if path.suffix == ".xml":
        assert np.array_equal(model.opt.gravity, gravity) and model.nu == len(joints)
    model.opt.gravity[:] = gravity
    # Dry friction and limits are constraints there; friction is added by hand.
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in joints]
    at, dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
    friction = model.dof_frictionloss[dof]
    data = mujoco.MjData(model)
    found = []
    for row in range(len(q)):
        data.qpos[at], data.qvel[dof], data.qacc[dof] = q[row], dq[row], ddq[row]
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse[dof].copy())
    return np.array(found) + friction * np.sign(dq)


result = {}
for name, library, path, expected in [
    ("pinocchio urdf", with_pinocchio, folder / "robot.urdf", in_urdf),
    ("mujoco urdf", with_mujoco, folder / "robot.urdf", in_urdf),
    ("mujoco mjcf", with_mujoco, folder / "robot.xml", in_mjcf),
]:
    try:
        result[name] = difference(library(path), expected)
    except Exception as error:
        result[name] = f"{type(error).__name__}: {error}"
print(json.dumps(result))
