"""USD to URDF: articulations of UsdPhysics, as Isaac Sim, Isaac Lab and usd-core write them.

    python -m dynid.usd robot.usd [robot.urdf] [--root /World/Robot]

It needs the package `usd-core`. Prims with `PhysicsRigidBodyAPI` become links; revolute, prismatic and fixed joints become joints, breadth
first from the base. Units become m, kg, rad, N m and N.

- Position 0 of a joint is where its two frames (`localPos0`, `localRot0` in body 0, `localPos1`, `localRot1` in body 1) coincide; the
  authored poses of bodies do not matter.
- The frame of a link is that of the joint that moves it. The base, and a link behind a fixed joint, keep the frame of their body. A joint
  whose body 1 is nearer to the base has its axis negated, so that positions and limits are those of the stage.
- A base that a joint holds to the world hangs on a link `world` with z up. One that no joint holds is the root link, below a link `upright`
  if it is authored with another attitude.
- Mass, centre of mass and inertia are those that are authored. A link that lacks one of them, which a simulator then works out of shapes,
  has no `<inertial>`; a density, or masses of shapes, in place of a mass are an error.

What URDF cannot hold, and what is left out, is in the notes of `convert` and in comments of the text.
"""

from __future__ import annotations

import argparse
import math
import os
import posixpath
import re
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ._fault import fault
from ._models import Vector, _rotation, _rpy
from ._native import DynidError, RobotError, UnsupportedError

_GRAVITY = 9.81
# What files put where there is no limit.
_NO_LIMIT = 1e10
# What PhysX takes where no velocity is authored, in degrees or units of length a second.
_NO_VELOCITY = 1e6
# Scales and attitudes that are off by less are off by rounding: quaternions are often of single precision.
_ROUNDING = 1e-6
_LEFT_OUT = (
    (re.compile(r"^drive:.*:(stiffness|damping)$"), "gains of drives, which are no stiffness or damping of joints,"),
    (re.compile(r"^physxJoint:jointFriction$"), "coefficients of PhysX, which are no friction in N m or N,"),
    (re.compile(r"mimic|tendon", re.IGNORECASE), "couplings of joints"),
    (re.compile(r"armature|friction|damping|stiffness", re.IGNORECASE), "values that URDF has no standard place for"),
)


@dataclass(frozen=True, eq=False)
class _Pose:
    """A frame in another one; lengths in m."""

    rotation: Vector
    position: Vector

    def __matmul__(self, other: _Pose) -> _Pose:
        return _Pose(self.rotation @ other.rotation, self.position + self.rotation @ other.position)

    def inverse(self) -> _Pose:
        return _Pose(self.rotation.T, -self.rotation.T @ self.position)


_HERE = _Pose(np.eye(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class _Joint:
    """A joint, and of both sides, that of body 0 first unless it is `reversed`, the body, None for the world, and the frame in it.

    `kind` is None if URDF has no such joint, `prim` if it stands for the attitude of a base that no joint holds.
    """

    prim: Any
    path: str
    kind: str | None
    bodies: tuple[str | None, str | None]
    frames: tuple[_Pose, _Pose]
    reversed: bool = False

    def outwards(self, parent: str | None) -> _Joint:
        """The joint with this body first."""
        if self.bodies[0] == parent:
            return self
        return replace(self, bodies=self.bodies[::-1], frames=self.frames[::-1], reversed=True)


def _value(prim: Any, name: str) -> Any:
    return prim.GetAttribute(f"physics:{name}").Get()


def _vector(prim: Any, name: str) -> Vector:
    return np.array(_value(prim, name), dtype=np.float64)


def _turn(prim: Any, name: str) -> Vector:
    """Matrix of a quaternion; one of zeros, as where none is authored, turns nothing."""
    q = np.array([_value(prim, name).GetReal(), *_value(prim, name).GetImaginary()], dtype=np.float64)
    return _rotation(q) if np.any(q) else np.eye(3)


def _within(path: str, root: str) -> bool:
    return path == root or path.startswith(root.rstrip("/") + "/")


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _numbers(values: Iterable[float], between: str = " ") -> str:
    # Adding zero takes the sign from a zero.
    return between.join(repr(float(x) + 0.0) for x in values)


def _authored(prim: Any, *names: str) -> float:
    """The first of these attributes that is authored; infinite if none is."""
    found = (prim.GetAttribute(name) for name in names if prim.GetAttribute(name).HasAuthoredValue())
    return next((float(attribute.Get()) for attribute in found), math.inf)


def _names(paths: Sequence[str], taken: Sequence[str]) -> dict[str, str]:
    """Names by path: the last part, with as many of those before it as tell it from others and from what is taken."""
    depth = dict.fromkeys(paths, 1)
    while True:
        names = {path: "_".join(path.split("/")[-n:]) if n <= path.count("/") else path for path, n in depth.items()}
        count = Counter([*names.values(), *taken])
        clashes = [path for path, name in names.items() if count[name] > 1]
        if not clashes:
            return names
        depth.update({path: depth[path] + 1 for path in clashes})


class _Stage:
    """Bodies and joints of a stage, in SI units."""

    def __init__(self, source: Any) -> None:
        try:
            self.usd, self.gf, geom, self.physics = (import_module(f"pxr.{name}") for name in ("Usd", "Gf", "UsdGeom", "UsdPhysics"))
        except ImportError:
            raise fault(UnsupportedError, "USD needs the package `usd-core`, which is not installed", "pip install usd-core") from None
        self.stage = self._opened(source)
        self.cache = geom.XformCache()
        self.metres = float(geom.GetStageMetersPerUnit(self.stage))
        self.kilograms = float(self.physics.GetStageKilogramsPerUnit(self.stage))
        self.notes = ["shapes for contact and for the eye are left out"]
        if not self.stage.HasAuthoredMetadata("metersPerUnit"):
            self.notes.append(f"the stage states no `metersPerUnit`: its unit of length is {self.metres:g} m, as USD has it then")
        # Turns axes of the stage into such with z up.
        self.upright: Vector = np.eye(3)
        if geom.GetStageUpAxis(self.stage) == geom.Tokens.y:
            self.upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
            self.notes.append("the stage has y up: it is turned about x, so that z is up in the root link")
        prims = list(self.usd.PrimRange.Stage(self.stage, self.usd.TraverseInstanceProxies()))
        rigid = [p for p in prims if p.HasAPI(self.physics.RigidBodyAPI) and _value(p, "rigidBodyEnabled")]
        self.bodies = {str(p.GetPath()): p for p in rigid}
        self.scene = next((p for p in prims if p.IsA(self.physics.Scene)), None)
        self.joints: list[_Joint] = []
        self.set_aside: list[_Joint] = []
        for prim in (p for p in prims if p.IsA(self.physics.Joint)):
            (body0, frame0), (body1, frame1) = (self._side(prim, k) for k in (0, 1))
            kind = self._kind(prim, None in (body0, body1))
            active = _value(prim, "jointEnabled") and not _value(prim, "excludeFromArticulation")
            joint = _Joint(prim, str(prim.GetPath()), kind, (body0, body1), (frame0, frame1))
            (self.joints if active else self.set_aside).append(joint)
        if strange := [p for p in prims if p.HasRelationship("physics:body0") and not p.IsA(self.physics.Joint)]:
            types = _listed(f"{p.GetPath()} ({p.GetTypeName()})" for p in strange)
            self.notes.append(f"joints of types that are not of UsdPhysics are left out: {types}")

    def _opened(self, source: Any) -> Any:
        if isinstance(source, self.usd.Stage):
            return source
        try:
            return self.usd.Stage.Open(os.fspath(source))
        except Exception as error:
            # It quotes what is wrong behind the place in its own sources.
            reason = re.search(r" : '(.+?)\n?'(\n|$)", str(error), re.DOTALL)
            text = f"{os.fspath(source)}: cannot be opened as USD: {reason.group(1) if reason else error}"
            raise fault(RobotError, text, "it takes files of USD: .usd, .usda, .usdc, .usdz") from error

    def _placed(self, prim: Any, matrix: Any = None) -> tuple[Vector, Vector]:
        """Rotation and scale of a prim in the world, or of what a matrix says of it."""
        stated = self.cache.GetLocalToWorldTransform(prim) if matrix is None else matrix
        linear = np.array(stated, dtype=np.float64)[:3, :3].T
        scale: Vector = np.linalg.norm(linear, axis=0)
        rotation = linear / np.where(scale > 0, scale, 1)
        if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-4 or np.linalg.det(rotation) < 0:
            text = f"{prim.GetPath()}: its transform shears, mirrors or flattens, which no rigid body does"
            raise fault(UnsupportedError, text, "scale the shapes below it, and leave it a rotation and a translation")
        return rotation, np.where(np.abs(scale - 1) < _ROUNDING, 1.0, scale)

    def _side(self, joint: Any, k: int) -> tuple[str | None, _Pose]:
        position, rotation = _vector(joint, f"localPos{k}"), _turn(joint, f"localRot{k}")
        targets = joint.GetRelationship(f"physics:body{k}").GetForwardedTargets()
        if not targets:
            return None, _Pose(rotation, self.metres * position)
        target = self.stage.GetPrimAtPath(targets[0])
        if not target:
            raise fault(RobotError, f"{joint.GetPath()}: there is no {targets[0]}, its body {k}", "mend or delete the joint")
        # A joint may be placed in a prim that moves with a body, or with none.
        body = self._body(target)
        matrix, scale = self.cache.GetLocalToWorldTransform(target), np.ones(3)
        if body:
            _, scale = self._placed(body)
            above = self.cache.GetLocalToWorldTransform(body)
            matrix = self.gf.Matrix4d(1) if body == target else matrix * above.GetInverse()
        at = self.metres * scale * np.array(matrix.Transform(self.gf.Vec3d(*position)), dtype=np.float64)
        return str(body.GetPath()) if body else None, _Pose(self._placed(target, matrix)[0] @ rotation, at)

    def _body(self, prim: Any) -> Any:
        """The body that a prim moves with."""
        while prim and str(prim.GetPath()) not in self.bodies:
            prim = prim.GetParent()
        return prim

    def _kind(self, prim: Any, to_world: bool) -> str | None:
        known = {"PhysicsRevoluteJoint": "revolute", "PhysicsPrismaticJoint": "prismatic", "PhysicsFixedJoint": "fixed"}
        if prim.GetTypeName() != "PhysicsJoint":
            return known.get(prim.GetTypeName())
        limited = [name.partition(":")[2] for name in prim.GetAppliedSchemas() if name.startswith("PhysicsLimitAPI:")]
        limits = {axis: [prim.GetAttribute(f"limit:{axis}:physics:{end}").Get() for end in ("low", "high")] for axis in limited}
        locked = {axis for axis, (low, high) in limits.items() if low > high}
        held = {f"{motion}{axis}" for motion in ("trans", "rot") for axis in "XYZ"} <= locked
        # Isaac Sim holds bases to the world by joints without a type and without limits.
        return "fixed" if held or (to_world and not limited) else None

    def group(self, root: str | None) -> list[str]:
        """Bodies of the articulation that is meant."""
        groups = {path: {path} for path in self.bodies}
        for a, b in (joint.bodies for joint in self.joints):
            if a is not None and b is not None:
                whole = groups[a] | groups[b]
                groups.update(dict.fromkeys(whole, whole))
        moved = {body for joint in self.joints if joint.kind != "fixed" for body in joint.bodies}
        distinct = {id(whole): whole for whole in groups.values() if moved & whole}
        found = [[path for path in self.bodies if path in whole] for whole in distinct.values()]
        meant = found if root is None else [group for group in found if any(_within(path, root) for path in group)]
        if len(meant) == 1:
            return meant[0]

        def title(group: list[str]) -> str:
            above = posixpath.commonpath(group)
            return group[0] if any(_within(path, above) for other in found if other is not group for path in other) else above

        where = f" at or below {root}" if root is not None else ""
        known = ", ".join(title(group) for group in meant or found)
        if meant:
            raise fault(RobotError, f"there are {len(meant)} articulations{where}: {known}", "name one as root (`--root`)")
        hint = "bodies need `PhysicsRigidBodyAPI`, joints `physics:body0` and `physics:body1`"
        raise fault(RobotError, f"no joint{where} moves a rigid body", f"articulations are at {known}" if found else hint)

    def tree(self, group: list[str]) -> tuple[str | None, list[_Joint]]:
        """The root, None for the world, and joints from there outwards, breadth first."""
        own = [joint for joint in self.joints if any(body in group for body in joint.bodies)]
        holders = sorted((joint for joint in own if None in joint.bodies and joint.kind), key=lambda joint: joint.kind != "fixed")
        usable = [joint for joint in own if joint.kind and None not in joint.bodies] + holders[:1]
        root = None if holders else self._free(group, own)
        reached, edges = [root], list[_Joint]()
        for body in reached:
            for joint in (joint.outwards(body) for joint in usable if body in joint.bodies):
                if joint.bodies[1] not in reached:
                    reached.append(joint.bodies[1])
                    edges.append(joint)
        for joint in own:
            if not joint.kind and not set(joint.bodies) <= set(reached):
                hint = "state it as revolute, prismatic and fixed joints, with bodies of small mass between them"
                raise fault(UnsupportedError, f"{joint.path}: URDF has no joint like a {joint.prim.GetTypeName()}", hint)
        kept = {joint.path for joint in edges}
        aside = [joint for joint in self.set_aside if any(body in group for body in joint.bodies)]
        for what, joints in (("close a loop", own), ("are disabled or excluded from the articulation", aside)):
            if left := [joint.path for joint in joints if joint.path not in kept]:
                self.notes.append(f"joints that {what} are left out: {_listed(left)}")
        attitude = _Pose(self._placed(self.bodies[root])[0], np.zeros(3)) if root else _HERE
        if root and np.abs(self.upright @ attitude.rotation - np.eye(3)).max() > _ROUNDING:
            return None, [_Joint(None, "/upright", "fixed", (None, root), (attitude, _HERE)), *edges]
        return root, edges

    def _free(self, group: list[str], own: list[_Joint]) -> str:
        """The base of an articulation that no joint holds to the world."""
        marked = [path for path in group if self.bodies[path].HasAPI(self.physics.ArticulationRootAPI)]
        moved = [joint.bodies[1] for joint in own]
        base = next(iter([*marked, *(path for path in group if path not in moved), *group]))
        self.notes.append(f"no joint holds `{base}` to the world: if it floats, read the URDF with `floating_base=True`")
        return base

    def inertial(self, path: str, frame: _Pose) -> list[str]:
        """`<inertial>` of a body in a frame of it; none if mass, centre of mass or inertia are not authored."""
        prim = self.bodies[path]
        if not self._has(prim, "mass"):
            parts = [p for p in self.usd.PrimRange(prim, self.usd.TraverseInstanceProxies()) if self._body(p) == prim]
            if any(self._has(part, key) for part in parts for key in ("mass", "density")):
                text = f"{path}: its mass follows from densities or masses of shapes, as a simulator works it out"
                raise fault(RobotError, text, "author `physics:mass`, `physics:centerOfMass` and `physics:diagonalInertia` of the body")
            return []
        com, diagonal = _vector(prim, "centerOfMass"), _vector(prim, "diagonalInertia")
        if not (np.isfinite(com).all() and np.any(diagonal)):
            return []
        # Positions are scaled with the body, inertias are not.
        at = frame.inverse() @ _Pose(_turn(prim, "principalAxes"), self.metres * self._placed(prim)[1] * com)
        tensor = self.kilograms * self.metres**2 * at.rotation @ np.diag(diagonal) @ at.rotation.T
        entries = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{_numbers([tensor[i, j]])}"' for i in range(3) for j in range(i, 3))
        mass = _numbers([self.kilograms * _value(prim, "mass")])
        origin = f'<origin xyz="{_numbers(at.position)}" rpy="0 0 0"/>'
        return ["    <inertial>", f"      {origin}", f'      <mass value="{mass}"/>', f"      <inertia {entries}/>", "    </inertial>"]

    def _has(self, prim: Any, key: str) -> bool:
        return bool(prim.HasAPI(self.physics.MassAPI) and _value(prim, key) > 0)

    def motion(self, joint: _Joint, name: str) -> tuple[str, list[str]]:
        """Type of a joint in URDF, with `<axis>` and `<limit>`."""
        prim, turns = joint.prim, joint.kind == "revolute"
        if joint.kind == "fixed":
            return "fixed", []
        axis = np.eye(3)["XYZ".index(_value(prim, "axis"))] * (-1 if joint.reversed else 1)
        unit, instance = (math.pi / 180, "angular") if turns else (self.metres, "linear")
        limits = [float(_value(prim, "lowerLimit")), float(_value(prim, "upperLimit"))]
        ends = sum(abs(x) < _NO_LIMIT for x in limits)
        bounded = ends == 2 and limits[0] <= limits[1]
        if ends and not bounded:
            self.notes.append(f"joint `{name}`: URDF has no limits like {limits} (as authored): they are left out")
        elif not bounded and not turns:
            self.notes.append(f"joint `{name}` slides without limits: some readers of URDF take that as 0 to 0")
        effort = _authored(prim, f"drive:{instance}:physics:maxForce")
        velocity = _authored(prim, f"physxJointAxis:{instance}:maxJointVelocity", "physxJoint:maxJointVelocity")
        force = self.kilograms * self.metres ** (2 if turns else 1)
        # URDF asks for both; 0 is what files put where there is none.
        most = [force * effort if effort < _NO_LIMIT else 0.0, unit * velocity if velocity < _NO_VELOCITY else 0.0]
        keys = (["lower", "upper"] if bounded else []) + ["effort", "velocity"]
        values = ([unit * x for x in limits] if bounded else []) + most
        limit = " ".join(f'{key}="{_numbers([value])}"' for key, value in zip(keys, values, strict=True))
        elements = [f'    <axis xyz="{_numbers(axis)}"/>', f"    <limit {limit}/>"]
        kind = "prismatic" if not turns else "revolute" if bounded else "continuous"
        return kind, elements if any(values) or kind != "continuous" else elements[:1]

    def tell(self, joints: list[_Joint], names: dict[str, str]) -> None:
        """Notes on attributes of joints that are not written, and on gravity if it is not what readers of URDF take."""
        found: dict[str, list[str]] = {what: [] for _, what in _LEFT_OUT}
        for joint in (joint for joint in joints if joint.prim):
            name = names[joint.path]
            for attribute in joint.prim.GetAuthoredAttributes():
                what = next((what for pattern, what in _LEFT_OUT if pattern.search(attribute.GetName())), None)
                if what is not None and attribute.Get():
                    found[what].append(f"`{name}` {attribute.GetName()} = {attribute.Get()}")
            if joint.prim.GetTypeName() == "PhysicsJoint" and None in joint.bodies:
                self.notes.append(f"joint `{name}` has no type and is taken as fixed, as Isaac Sim holds bases to the world")
        self.notes += [f"{what} are left out (as authored): {'; '.join(values)}" for what, values in found.items() if values]
        if self.scene is not None:
            magnitude, direction = float(_value(self.scene, "gravityMagnitude")), self.upright @ _vector(self.scene, "gravityDirection")
            down = np.array([0.0, 0.0, -1.0])
            along = direction / np.linalg.norm(direction) if np.any(direction) else down
            gravity = along * (magnitude * self.metres if magnitude >= 0 else _GRAVITY)
            if np.abs(gravity - _GRAVITY * down).max() > _ROUNDING * _GRAVITY:
                stated = _numbers(gravity, ", ")
                self.notes.append(f"gravity of the stage is not {_GRAVITY} downwards: read the URDF with `gravity=[{stated}]`")


def _converted(source: Any, root: str | None) -> tuple[str, list[str]]:
    """URDF text and notes."""
    stage = _Stage(source)
    group = stage.group(root)
    base, edges = stage.tree(group)
    order = [*([base] if base else []), *(str(joint.bodies[1]) for joint in edges)]
    top = "" if base else "world" if edges[0].prim else "upright"
    links, joints = _names(order, [top]), _names([joint.path for joint in edges], [])
    for what, names in (("links", links), ("joints", joints)):
        if longer := [name for path, name in names.items() if name != posixpath.basename(path)]:
            stage.notes.append(f"{what} are called by more of their path, for others are called alike: {_listed(longer)}")
    stage.tell(edges, joints)
    lines, bare = [f"  <link name={quoteattr(top)}/>"] if top else [], list[str]()
    frames: dict[str | None, _Pose] = {None: _Pose(stage.upright.T, np.zeros(3))}

    def link(path: str, frame: _Pose) -> None:
        inertial = stage.inertial(path, frame)
        frames[path] = frame
        bare.extend([] if inertial else [links[path]])
        lines.extend([f"  <link name={quoteattr(links[path])}>", *inertial, "  </link>"])

    if base:
        link(base, _HERE)
    for joint in edges:
        parent, child, name = joint.bodies[0], str(joint.bodies[1]), joints[joint.path]
        at = frames[parent].inverse() @ joint.frames[0]
        kind, motion = stage.motion(joint, name)
        if kind == "fixed":
            at = at @ joint.frames[1].inverse()
        lines += [f'  <joint name={quoteattr(name)} type="{kind}">']
        lines += [f'    <origin xyz="{_numbers(at.position)}" rpy="{_numbers(_rpy(at.rotation))}"/>']
        lines += [f"    <parent link={quoteattr(links[parent] if parent else top)}/>", f"    <child link={quoteattr(links[child])}/>"]
        lines += [*motion, "  </joint>"]
        link(child, _HERE if kind == "fixed" else joint.frames[1])
    if bare:
        stage.notes.append(f"links without `<inertial>`, for mass, centre of mass or inertia are not authored: {_listed(bare)}")
    robot = posixpath.basename(posixpath.commonpath(group)) or "robot"
    # Two dashes would end a comment.
    comments = [f"  <!-- {note.replace('--', '- -')} -->" for note in stage.notes]
    return "\n".join(['<?xml version="1.0"?>', f"<robot name={quoteattr(robot)}>", *comments, *lines, "</robot>", ""]), stage.notes


def to_urdf(stage_or_path: Any, root: str | None = None) -> str:
    """The URDF text of an articulation of a `Usd.Stage`, or of a file of one; notes stand in comments.

    `root`: the path of a prim at or above bodies of the articulation, where there are several. Raises `UnsupportedError` without `usd-core`
    and for what has no form in URDF, `RobotError` for what is missing or not clear.
    """
    return _converted(stage_or_path, root)[0]


def convert(path: str | os.PathLike[str], out: str | os.PathLike[str], root: str | None = None) -> list[str]:
    """Writes the URDF of a USD file to `out`, as `to_urdf` gives it; gives notes on what URDF cannot hold and what is left out."""
    text, notes = _converted(path, root)
    Path(out).write_text(text, encoding="utf-8")
    return notes


def main() -> int:
    """Runs the script with the arguments of this process."""
    parser = argparse.ArgumentParser(prog="python -m dynid.usd", description="Writes an articulation of a USD file as URDF.")
    parser.add_argument("usd", help="file of USD: .usd, .usda, .usdc, .usdz")
    parser.add_argument("urdf", nargs="?", help="file to write (default: standard output)")
    parser.add_argument("--root", help="path of a prim at or above the robot, where there are several")
    given = parser.parse_args()
    try:
        text, notes = _converted(given.usd, given.root)
        if given.urdf:
            Path(given.urdf).write_text(text, encoding="utf-8")
        else:
            sys.stdout.write(text)
    except (DynidError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
