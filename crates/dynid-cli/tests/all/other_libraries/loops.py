"""Efforts of the drives of a mechanism with loops by MuJoCo, from its constraint Jacobian and its tree.

Arguments: an MJCF file with a key, a table of states of the drives (q_<joint>, dq_<joint>, ddq_<joint>), a table of efforts
(effort_<joint>). Prints one line of JSON: the largest gap of the loops at the key (m), and the largest difference of effort, joint by joint
relative to the largest effort.
"""

import csv
import json
import sys

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)


def table(name):
    with open(name, newline="") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], np.array(rows[1:], dtype=float).T))


states, efforts = table(sys.argv[2]), table(sys.argv[3])
drives = [name[2:] for name in states if name.startswith("q_")]
dofs = [model.jnt_dofadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, j)] for j in drives]
others = [k for k in range(model.nv) if k not in dofs]


def jacobian():
    whole = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(whole, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        whole = data.efc_J.reshape(data.nefc, model.nv)
    return whole[: data.ne]


def velocity_map():
    rows = jacobian()
    out = np.zeros((model.nv, len(dofs)))
    out[dofs, range(len(dofs))] = 1.0
    out[others] = -np.linalg.lstsq(rows[:, others], rows[:, dofs], rcond=1e-9)[0]
    return out


def close(position):
    data.qpos[dofs] = position
    for _ in range(50):
        mujoco.mj_forward(model, data)
        gap = data.efc_pos[: data.ne].copy()
        if np.abs(gap).max() < 1e-12:
            return
        data.qpos[others] -= np.linalg.lstsq(jacobian()[:, others], gap, rcond=1e-9)[0]


def map_at(position):
    data.qpos[:] = position
    mujoco.mj_forward(model, data)
    return velocity_map()


mujoco.mj_resetDataKeyframe(model, data, 0)
mujoco.mj_forward(model, data)
gap = float(np.abs(data.efc_pos[: data.ne]).max())
found = []
for k in range(len(states["q_" + drives[0]])):
    q, dq, ddq = (np.array([states[f"{s}_{j}"][k] for j in drives]) for s in ("q", "dq", "ddq"))
    close(q)
    here, rates = data.qpos.copy(), velocity_map()
    rate, h = rates @ dq, 1e-6
    bias = (map_at(here + h * rate) - map_at(here - h * rate)) / (2 * h) @ dq
    data.qpos[:], data.qvel[:] = here, rate
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, mass, data.qM)
    except (AttributeError, TypeError):
        mujoco.mj_fullM(model, data, mass)
    friction = model.dof_damping * rate + model.dof_frictionloss * np.sign(rate)
    found.append(rates.T @ (mass @ (rates @ ddq + bias) + data.qfrc_bias + friction))
expected = np.array([efforts[f"effort_{j}"] for j in drives]).T
difference = np.max(np.abs(np.array(found) - expected), axis=0) / np.max(np.abs(expected), axis=0)
print(json.dumps({"gap": gap, "difference": float(difference.max())}))
