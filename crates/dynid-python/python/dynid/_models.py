"""Robots of other libraries: read into the TOML of a robot file, and identified values put back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._fault import fault
from ._native import UnsupportedError

Vector = NDArray[np.float64]

_ORDER = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
# What libraries put where there is no limit.
_NO_LIMIT = 1e10
# What the base is called in robot files.
_GROUND = "ground"


def _rpy(rotation: Vector) -> list[float]:
    """Angles of `Rz(yaw) Ry(pitch) Rx(roll)`. Near a pitch of a right angle, yaw is rounding, and roll makes up for it: it is taken from what
    yaw leaves."""
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    left = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ rotation
    return [math.atan2(-left[1, 2], left[1, 1]), math.atan2(-left[2, 0], left[0, 0]), yaw]


def _phi(mass: float, com: Vector, about_com: Vector) -> list[float]:
    """Ten standard parameters about the origin that `com` is counted from."""
    about = about_com + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return [mass, *(mass * com), about[0, 0], about[0, 1], about[0, 2], about[1, 1], about[1, 2], about[2, 2]]


def _number(x: float) -> str:
    return repr(float(x))


def _numbers(values: Sequence[float] | Vector) -> str:
    return "[" + ", ".join(_number(x) for x in values) + "]"


class _Text:
    """A robot file in the making."""

    def __init__(self, name: str, gravity: Vector) -> None:
        self.lines = ["schema = 1", f"name = {json.dumps(name)}", f"gravity = {_numbers(gravity)}"]
        self.elements: list[str] = []
        self.massless: list[str] = []
        self.warnings: list[str] = []

    def body(
        self,
        name: str,
        parent: str,
        joint: str,
        kind: str,
        place: tuple[Vector, Vector],
        *,
        axis: Vector | None = None,
        limits: Mapping[str, Any] | None = None,
        phi: Sequence[float] | None = None,
        pitch: float | None = None,
    ) -> None:
        if name == _GROUND:
            raise fault(UnsupportedError, f"a body is called `{_GROUND}`, as the base is in robot files", "give it another name")
        rotation, position = place
        keys = [f"name = {json.dumps(joint)}", f"kind = {json.dumps(kind)}", f"xyz = {_numbers(position)}", f"rpy = {_numbers(_rpy(rotation))}"]
        if axis is not None:
            keys.append(f"axis = {_numbers(axis / np.linalg.norm(axis))}")
        if pitch is not None:
            keys.append(f"pitch = {_number(pitch)}")
        if limits:
            parts = [f"{key} = {_numbers(value) if isinstance(value, list) else _number(value)}" for key, value in limits.items()]
            keys.append(f"limits = {{ {', '.join(parts)} }}")
        self.lines += ["", "[[body]]", f"name = {json.dumps(name)}", f"parent = {json.dumps(parent)}", f"joint = {{ {', '.join(keys)} }}"]
        if phi is None:
            self.massless.append(name)
        self.lines.append(f"phi = {_numbers(phi if phi is not None else [0.0] * 10)}")

    def joint_values(self, joint: str, *, rotor: float, damping: float, friction: float, spring: tuple[float, float] = (0.0, 0.0)) -> None:
        """States what a model says of a joint, for simulations and as what is thought beforehand."""
        stated = {"rotor = { inertia": rotor, "viscous = { coefficient": damping, "coulomb = { effort": friction}
        lines = [f"{key} = {_number(value)} }}" for key, value in stated.items() if value > 0]
        stiffness, rest = spring
        if stiffness > 0:
            lines += ['beside = ["spring"]', f"spring = {{ stiffness = {_number(stiffness)}, kq0 = {_number(stiffness * rest)} }}"]
        if lines:
            self.elements += ["", f"[element.{json.dumps(joint)}]", *lines]

    def text(self) -> str:
        # Links between joints of one body are no bodies.
        ties = [f"tie = [{{ massless = {json.dumps(self.massless)} }}]"] if self.massless else []
        return "\n".join([*self.lines[:3], *ties, *self.lines[3:], *self.elements, ""])


def _limits(low: float, high: float, velocity: float = math.inf, effort: float = math.inf) -> dict[str, Any]:
    out: dict[str, Any] = {}
    if abs(low) < _NO_LIMIT and abs(high) < _NO_LIMIT and low < high:
        out["position"] = [float(low), float(high)]
    out.update({key: float(x) for key, x in (("velocity", velocity), ("effort", effort)) if 0 < x < _NO_LIMIT})
    return out


def from_pinocchio(model: Any) -> tuple[str, list[str]]:
    """The robot file of a `pinocchio.Model`, and warnings."""
    pin: Any = import_module("pinocchio")

    text = _Text(model.name or "pinocchio model", np.asarray(model.gravity.linear))
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    names = {frame.parentJoint: frame.name for frame in reversed(list(model.frames)) if frame.type == pin.FrameType.BODY}
    links = {0: _GROUND}
    for i in range(1, model.njoints):
        joint, name = model.joints[i], model.names[i]
        links[i] = names.get(i, f"{name}_link") if i in names and names[i] not in links.values() else f"{name}_link"
        placement = model.jointPlacements[i]
        place = (np.asarray(placement.rotation), np.asarray(placement.translation))
        d = np.asarray(model.inertias[i].toDynamicParameters())
        phi = [*d[:6], d[7], d[6], d[8], d[9]]
        parent = links[model.parents[i]]
        if joint.nv == 6 and joint.nq == 7:
            text.body(links[i], parent, name, "floating", place, phi=phi)
            continue
        if joint.nv != 1:
            raise fault(
                UnsupportedError,
                f"joint `{name}` ({joint.shortname()}) has {joint.nv} degrees of freedom",
                "joints turn, slide, screw or float: build the model with those",
            )
        space = pin.getJointJacobian(model, data, i, pin.LOCAL)[:, joint.idx_v]
        linear, angular = space[:3], space[3:]
        v = joint.idx_v
        limit = (float(model.velocityLimit[v]), float(model.effortLimit[v]))
        q = joint.idx_q
        bounds = _limits(*_limit_of(model, q), *limit) if joint.nq == 1 else _limits(math.inf, math.inf, *limit)
        if np.linalg.norm(angular) == 0:
            text.body(links[i], parent, name, "prismatic", place, axis=linear, limits=bounds, phi=phi)
        elif np.linalg.norm(linear) == 0:
            kind = "revolute" if joint.nq == 1 else "continuous"
            if joint.nq == 2:
                text.warnings.append(f"joint `{name}` turns without end: its position is the angle here, not cosine and sine")
            text.body(links[i], parent, name, kind, place, axis=angular, limits=bounds, phi=phi)
        else:
            pitch = float(linear @ angular)
            text.body(links[i], parent, name, "helical", place, axis=angular, limits=bounds, phi=phi, pitch=pitch)
        armature = float(np.asarray(model.armature)[v])
        damping = float(np.asarray(model.damping)[v])
        text.joint_values(name, rotor=armature, damping=damping, friction=float(np.asarray(_dry_friction(model))[v]))
    return text.text(), text.warnings


def _limit_of(model: Any, q: int) -> tuple[float, float]:
    """Range of a position of a `pinocchio.Model`."""
    return float(model.lowerPositionLimit[q]), float(model.upperPositionLimit[q])


def _dry_friction(model: Any) -> Any:
    return getattr(model, "upperDryFrictionLimit", None) if hasattr(model, "upperDryFrictionLimit") else model.friction


def _rotation(quaternion: Vector) -> Vector:
    """Matrix of a unit quaternion `w x y z`."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _about(axis: Vector, angle: float) -> Vector:
    half = angle / 2
    return _rotation(np.array([math.cos(half), *(math.sin(half) * axis / np.linalg.norm(axis))]))


def _body_names(model: Any) -> list[str]:
    return [model.body(b).name or f"body{b}" for b in range(model.nbody)]


def from_mujoco(model: Any) -> tuple[str, list[str]]:
    """The robot file of a `mujoco.MjModel`, and warnings."""
    names = _body_names(model)
    text = _Text("mujoco model", np.array(model.opt.gravity))
    # Of every body: the link that carries its frame, and where its frame is from there.
    carried: dict[int, tuple[str, Vector]] = {0: (_GROUND, np.zeros(3))}
    for b in range(1, model.nbody):
        parent, shift = carried[int(model.body_parentid[b])]
        rotation, origin = _rotation(model.body_quat[b]), model.body_pos[b] + shift
        com, principal = np.array(model.body_ipos[b]), _rotation(model.body_iquat[b])
        about_com = principal @ np.diag(model.body_inertia[b]) @ principal.T
        mass, first, count = float(model.body_mass[b]), int(model.body_jntadr[b]), int(model.body_jntnum[b])
        if count == 0:
            text.body(names[b], parent, f"{names[b]}_fixed", "fixed", (rotation, origin), phi=_phi(mass, com, about_com))
            carried[b] = (names[b], np.zeros(3))
            continue
        last = np.zeros(3)
        for k in range(count):
            j = first + k
            joint, kind = model.joint(j).name or f"joint{j}", int(model.jnt_type[j])
            if kind not in (2, 3):
                what = "free" if kind == 0 else "ball"
                raise fault(
                    UnsupportedError,
                    f"joint `{joint}` of body `{names[b]}` is a {what} joint",
                    "a fixed base, and joints that turn or slide, can be identified",
                )
            anchor, axis = np.array(model.jnt_pos[j]), np.array(model.jnt_axis[j])
            zero = float(model.qpos0[model.jnt_qposadr[j]])
            # The frame of the first joint is placed from the parent, others from the joint before.
            turned, at = (rotation, origin + rotation @ anchor) if k == 0 else (np.eye(3), anchor - last)
            if kind == 3:
                turned = turned @ _about(axis, -zero)
            else:
                at = at - turned @ axis * zero
            effort = float(model.jnt_actfrcrange[j][1]) if model.jnt_actfrclimited[j] else math.inf
            low, high = map(float, model.jnt_range[j]) if model.jnt_limited[j] else (math.inf, math.inf)
            bounds = _limits(low, high, math.inf, effort)
            end = k + 1 == count
            link = names[b] if end else f"{names[b]}__{joint}"
            phi = _phi(mass, com - anchor, about_com) if end else None
            text.body(link, parent, joint, "revolute" if kind == 3 else "prismatic", (turned, at), axis=axis, limits=bounds, phi=phi)
            d = int(model.jnt_dofadr[j])
            text.joint_values(
                joint,
                rotor=float(model.dof_armature[d]),
                damping=float(model.dof_damping[d]),
                friction=float(model.dof_frictionloss[d]),
                spring=(float(model.jnt_stiffness[j]), float(model.qpos_spring[model.jnt_qposadr[j]])),
            )
            # Later versions have polynomials beside the linear terms.
            for what in ("jnt_stiffnesspoly", "dof_dampingpoly"):
                if np.any(getattr(model, what, np.zeros(model.nv))[d if what.startswith("dof") else j]):
                    text.warnings.append(f"joint `{joint}`: its `{what}` is left out")
            parent, last = link, anchor
        carried[b] = (names[b], -last)
    if model.neq:
        text.warnings.append(f"{model.neq} equality constraints are left out: state loops in a robot file")
    if model.opt.density > 0 or model.opt.viscosity > 0:
        text.warnings.append("forces of the medium (`density`, `viscosity`) are left out")
    if np.any(np.asarray(model.body_gravcomp)):
        text.warnings.append("gravity compensation of bodies is left out")
    return text.text(), text.warnings


def apply(record: Mapping[str, Any], model: Any) -> list[str]:
    """Puts an estimate into a model of another library; gives what has no place there."""
    phi: dict[str, dict[str, float]] = {}
    for p in record["parameters"]:
        if p.get("link"):
            phi.setdefault(p["link"], {})[p["name"].rsplit(".", 1)[1]] = p["value"]
    bodies = {link: np.array([values[key] for key in _ORDER]) for link, values in phi.items() if set(_ORDER) <= set(values)}
    joints = {j["joint"]: j for j in record["exported"]["joints"]}
    if hasattr(model, "body_mass"):
        _apply_mujoco(bodies, joints, model)
    elif hasattr(model, "jointPlacements"):
        _apply_pinocchio(bodies, joints, model)
    else:
        raise TypeError(f"model: expected a mujoco.MjModel or a pinocchio.Model, found {type(model).__name__}")
    forms = [
        f"friction of joint `{p['joint']}` stands as friction loss and damping: " + ", ".join(n for n, _ in p["parameters"])
        for p in record["exported"]["projections"]
    ]
    offsets = [p["name"] for p in record["parameters"] if p.get("joint") and p["name"].endswith(".fo") and p["value"] != 0]
    return forms + [f"`{name}` has no place in the model" for name in offsets]


def _tensor(phi: Vector) -> Vector:
    xx, xy, xz, yy, yz, zz = phi[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _central(phi: Vector) -> tuple[float, Vector, Vector]:
    """Mass, centre of mass, inertia about it."""
    mass = float(phi[0])
    com = phi[1:4] / mass if mass > 0 else np.zeros(3)
    return mass, com, _tensor(phi) - mass * (com @ com * np.eye(3) - np.outer(com, com))


def _none_held(known: Sequence[str], joints: Mapping[str, Any]) -> None:
    held = [name for name in known if name not in joints]
    if held:
        # Their links are part of the body that carried them, and would count twice.
        raise fault(
            UnsupportedError, f"joints {', '.join(held)} of the model were held in the identification", "log them, or export: `to_urdf`, `to_mjcf`"
        )


def _missing(kind: str, known: Sequence[str], wanted: Mapping[str, Any]) -> None:
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise KeyError(f"the model has no {kind} called {', '.join(unknown)}: is it the one that the robot was made of?")


def _apply_mujoco(bodies: Mapping[str, Vector], joints: Mapping[str, Any], model: Any) -> None:
    names = _body_names(model)
    all_joints = {model.joint(j).name or f"joint{j}": j for j in range(model.njnt)}
    parts = {f"{names[int(model.jnt_bodyid[j])]}__{name}" for name, j in all_joints.items()}
    _missing("body", [*names, *parts], bodies)
    _missing("joint", list(all_joints), joints)
    _none_held(list(all_joints), joints)
    for b, name in enumerate(names):
        if name not in bodies:
            if b > 0 and int(model.body_jntnum[b]) == 0 and int(model.body_weldid[b]) != 0:
                # What moves with its parent is part of that.
                model.body_mass[b], model.body_inertia[b] = 0.0, 0.0
            continue
        mass, com, about = _central(bodies[name])
        moments, axes = np.linalg.eigh(about)
        moments, axes = moments[::-1], axes[:, ::-1].copy()
        if np.linalg.det(axes) < 0:
            axes[:, 2] *= -1
        anchor = model.jnt_pos[int(model.body_jntadr[b]) + int(model.body_jntnum[b]) - 1]
        model.body_mass[b] = mass
        model.body_ipos[b] = com + anchor
        model.body_inertia[b] = moments
        model.body_iquat[b] = _quaternion(axes)
    for name, values in joints.items():
        d = int(model.jnt_dofadr[all_joints[name]])
        model.dof_armature[d] = values["rotor_inertia"]
        model.dof_damping[d] = values["damping"]
        model.dof_frictionloss[d] = values["friction_loss"]
        model.jnt_stiffness[all_joints[name]] = values["stiffness"]
        if values["stiffness"] > 0:
            model.qpos_spring[model.jnt_qposadr[all_joints[name]]] = values["spring_reference"]
        if hasattr(model, "dof_dampingpoly"):
            # The damping that was found stands for all of it.
            model.dof_dampingpoly[d] = 0


def _quaternion(rotation: Vector) -> Vector:
    """Unit quaternion `w x y z`, by its largest component."""
    m = rotation
    trace = np.array([m.trace(), m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(trace))
    if largest == 0:
        q = np.array([1 + trace[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.zeros(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    unit: Vector = q / np.linalg.norm(q)
    return unit


def _apply_pinocchio(bodies: Mapping[str, Vector], joints: Mapping[str, Any], model: Any) -> None:
    pin: Any = import_module("pinocchio")

    of_link = {frame.name: frame.parentJoint for frame in model.frames if frame.type == pin.FrameType.BODY}
    of_link.update({f"{name}_link": i for i, name in enumerate(model.names) if f"{name}_link" not in of_link})
    _missing("link", list(of_link), bodies)
    _missing("joint", list(model.names), joints)
    _none_held(list(model.names)[1:], joints)
    for link, phi in bodies.items():
        parameters = np.array([*phi[:6], phi[7], phi[6], phi[8], phi[9]])
        model.inertias[of_link[link]] = pin.Inertia.FromDynamicParameters(parameters)
    armature, damping = np.array(model.armature), np.array(model.damping)
    lower, upper = (np.array(getattr(model, name, np.zeros(model.nv))) for name in ("lowerDryFrictionLimit", "upperDryFrictionLimit"))
    for name, values in joints.items():
        v = model.joints[model.getJointId(name)].idx_v
        armature[v], damping[v] = values["rotor_inertia"], values["damping"]
        upper[v], lower[v] = values["friction_loss"], -values["friction_loss"]
    model.armature, model.damping = armature, damping
    if hasattr(model, "upperDryFrictionLimit"):
        model.upperDryFrictionLimit, model.lowerDryFrictionLimit = upper, lower
    else:
        model.friction = upper
