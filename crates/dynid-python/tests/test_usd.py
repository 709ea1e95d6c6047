"""USD against Pinocchio: random articulations, authored with usd-core, and what is told and refused."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import dynid
import dynid.usd
import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("pxr")
pin = pytest.importorskip("pinocchio")
Gf, Sdf, Usd, UsdGeom, UsdPhysics = (pytest.importorskip(f"pxr.{name}") for name in ("Gf", "Sdf", "Usd", "UsdGeom", "UsdPhysics"))

Array = NDArray[np.float64]

TYPES = {
    "revolute": UsdPhysics.RevoluteJoint,
    "prismatic": UsdPhysics.PrismaticJoint,
    "fixed": UsdPhysics.FixedJoint,
    "general": UsdPhysics.Joint,
}
MOTIONS = {"revolute": pin.JointModelRevoluteUnaligned, "prismatic": pin.JointModelPrismaticUnaligned}
CHAIN = (UsdPhysics.RevoluteJoint, UsdPhysics.PrismaticJoint)


def turned(quaternion: Any) -> Array:
    """Matrix of a quaternion of USD."""
    rotation: Array = pin.Quaternion(quaternion.GetReal(), *map(float, quaternion.GetImaginary())).normalized().matrix()
    return rotation


class Random:
    """An articulation in the making, and the same for Pinocchio, from what the stage holds of it."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.stage = Usd.Stage.CreateInMemory()
        self.metres, self.kilograms = float(self.rng.choice([1.0, 0.01])), float(self.rng.choice([1.0, 0.001]))
        self.y_up = self.chance(0.3)
        UsdGeom.SetStageMetersPerUnit(self.stage, self.metres)
        UsdPhysics.SetStageKilogramsPerUnit(self.stage, self.kilograms)
        UsdGeom.SetStageUpAxis(self.stage, "Y" if self.y_up else "Z")
        # A scale of the whole robot, or one of every body.
        self.scaled = str(self.rng.choice(["not", "whole", "bodies"]))
        self.whole = float(self.rng.uniform(0.5, 2)) if self.scaled == "whole" else 1.0
        self.frame("/World/Robot", pin.SE3.Identity(), np.full(3, self.whole))
        self.ground = self.place()
        self.frame("/World/Ground", self.ground, np.ones(3))
        # Of bodies: their scale and attitude in the world, the joint of the twin that carries them, and their frame in that of the joint.
        self.scale: dict[str, Array] = {}
        self.attitude: dict[str, Array] = {}
        self.carrier: dict[str | None, tuple[int, Any]] = {None: (0, pin.SE3.Identity())}
        self.twin = pin.Model()
        self.twin.gravity.linear = np.array([0, -9.81, 0] if self.y_up else [0, 0, -9.81])
        # Joints whose body 1 is nearer to the base turn the other way.
        self.signs: dict[str, float] = {}

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def place(self) -> Any:
        """A random frame, in units of the stage."""
        return pin.SE3(pin.rpy.rpyToMatrix(self.rng.uniform(-3, 3, 3)), self.rng.uniform(-0.4, 0.4, 3) / self.metres)

    def frame(self, path: str, place: Any, scale: Array) -> Any:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[3, :3] = (place.rotation * scale).T, place.translation
        prim = UsdGeom.Xform.Define(self.stage, path)
        prim.AddTransformOp().Set(Gf.Matrix4d(matrix.tolist()))
        return prim.GetPrim()

    def body(self, parent: str | None) -> str:
        """A body, beside the others or below its parent, in a pose that has nothing to do with the joints."""
        nested = parent is not None and self.scaled != "bodies" and self.chance(0.3)
        path = f"{parent if nested else '/World/Robot'}/link{len(self.scale)}"
        scale = self.rng.uniform(0.5, 2, 3) if self.scaled == "bodies" else np.ones(3)
        place = self.place()
        prim = self.frame(path, place, scale)
        self.scale[path] = scale * self.whole
        self.attitude[path] = self.attitude[str(parent)] @ place.rotation if nested else place.rotation
        UsdPhysics.RigidBodyAPI.Apply(prim)
        mass = UsdPhysics.MassAPI.Apply(prim)
        mass.CreateMassAttr(self.rng.uniform(0.1, 5) / self.kilograms)
        mass.CreateCenterOfMassAttr(Gf.Vec3f(*(self.rng.uniform(-0.3, 0.3, 3) / self.metres)))
        mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*(self.rng.uniform(0.1, 0.15, 3) / self.kilograms / self.metres**2)))
        if self.chance(0.8):
            mass.CreatePrincipalAxesAttr(self.quaternion())
        return path

    def quaternion(self) -> Any:
        w, x, y, z = self.rng.normal(size=4)
        return Gf.Quatf(w, x, y, z).GetNormalized()

    def side(self, joint: Any, k: int, body: str | None) -> Any:
        """Authors a side of a joint, at times in a frame of its own, and gives the frame in the body, in m."""
        target, above, scale = body, pin.SE3.Identity(), self.scale[body] if body else np.ones(3)
        if self.chance(0.3):
            target, above = "/World/Ground", self.ground
            if body:
                above = self.place()
                target = f"{body}/site{joint.GetPrim().GetName()}"
                self.frame(target, above, np.ones(3))
        if target:
            (joint.CreateBody1Rel() if k else joint.CreateBody0Rel()).SetTargets([target])
        position = joint.CreateLocalPos1Attr() if k else joint.CreateLocalPos0Attr()
        rotation = joint.CreateLocalRot1Attr() if k else joint.CreateLocalRot0Attr()
        if self.chance(0.8):
            position.Set(Gf.Vec3f(*(self.rng.uniform(-0.4, 0.4, 3) / self.metres)))
            rotation.Set(self.quaternion())
        own = pin.SE3(turned(rotation.Get()), np.array(position.Get(), dtype=float))
        inside = above * own
        return pin.SE3(inside.rotation, self.metres * scale * inside.translation)

    def joint(self, name: str, kind: str, parent: str | None, child: str) -> None:
        joint = TYPES[kind].Define(self.stage, f"/World/Robot/joints/{name}")
        backwards = self.chance(0.4)
        ends = (1, 0) if backwards else (0, 1)
        at_parent, at_child = (self.side(joint, k, body) for k, body in zip(ends, (parent, child), strict=True))
        carrier, of_parent = self.carrier[parent]
        at = of_parent * at_parent
        if kind in ("fixed", "general"):
            self.carrier[child] = (carrier, at * at_child.inverse())
            return
        axis = str(self.rng.choice(["X", "Y", "Z"]))
        joint.CreateAxisAttr(axis)
        if self.chance(0.5):
            joint.CreateLowerLimitAttr(-1.0)
            joint.CreateUpperLimitAttr(2.0)
        motion = MOTIONS[kind](np.eye(3)["XYZ".index(axis)])
        self.carrier[child] = (self.twin.addJoint(carrier, motion, at, name), at_child.inverse())
        self.signs[name] = -1.0 if backwards else 1.0

    def finish(self) -> None:
        UsdGeom.Scope.Define(self.stage, "/World/Robot/joints")
        base = self.body(None)
        held = str(self.rng.choice(["fixed", "general", "revolute", "not"]))
        # A base that nothing holds keeps its attitude.
        self.carrier[base] = (0, pin.SE3(self.attitude[base], np.zeros(3)))
        edges: list[tuple[str | None, str, str]] = [] if held == "not" else [(None, base, held)]
        if held == "not":
            UsdPhysics.ArticulationRootAPI.Apply(self.stage.GetPrimAtPath(base))
        for k in range(int(self.rng.integers(3, 9))):
            parent = str(self.rng.choice(list(self.scale)))
            edges.append((parent, self.body(parent), str(self.rng.choice(["revolute", "prismatic", "fixed"])) if k else "revolute"))
        numbers = self.rng.permutation(len(edges))
        for number, (parent_or_world, child, kind) in zip(numbers, edges, strict=True):
            self.joint(f"joint{number}", kind, parent_or_world, child)
        order = [f"joint{k}" for k in range(len(edges))]
        self.stage.GetPrimAtPath("/World/Robot/joints").SetChildrenReorder(order)
        for body, scale in self.scale.items():
            mass = UsdPhysics.MassAPI(self.stage.GetPrimAtPath(body))
            axes = mass.GetPrincipalAxesAttr()
            rotation = turned(axes.Get()) if axes.HasAuthoredValue() else np.eye(3)
            diagonal = np.array(mass.GetDiagonalInertiaAttr().Get(), dtype=float) * self.kilograms * self.metres**2
            com = self.metres * scale * np.array(mass.GetCenterOfMassAttr().Get(), dtype=float)
            inertia = pin.Inertia(self.kilograms * mass.GetMassAttr().Get(), com, rotation @ np.diag(diagonal) @ rotation.T)
            carrier, frame = self.carrier[body]
            if carrier > 0:
                self.twin.appendBodyToJoint(carrier, inertia, frame)


def worst(seed: int) -> float:
    """Largest difference of efforts from those of the twin, relative to the largest effort."""
    random = Random(seed)
    random.finish()
    model = random.twin
    robot = dynid.Robot.parse(dynid.usd.to_urdf(random.stage), "robot.urdf")
    assert sorted(robot.joints) == sorted(list(model.names)[1:])
    rng, data = np.random.default_rng(seed), model.createData()
    q, v, a = (rng.uniform(-2, 2, (20, model.nv)) for _ in range(3))
    signs = np.array([random.signs[name] for name in list(model.names)[1:]])
    theirs = signs * np.array([pin.rnea(model, data, *x).copy() for x in zip(signs * q, signs * v, signs * a, strict=True)])
    back = np.argsort([robot.joints.index(name) for name in list(model.names)[1:]])
    ours = robot.inverse_dynamics(q[:, back], v[:, back], a[:, back])
    return float(np.abs(ours - theirs[:, back]).max() / np.abs(theirs).max())


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_random_articulations_have_the_efforts_of_pinocchio(seed: int) -> None:
    assert worst(seed) <= 1e-9


def robot(root: str = "/World/Robot", stage: Any = None, *, joints: tuple[Any, ...] = CHAIN) -> Any:
    """A base that is held, and a chain of bodies in m and kg: `base`, `link1` .., `joint1` .."""
    if stage is None:
        stage = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageMetersPerUnit(stage, 1)
        UsdGeom.SetStageUpAxis(stage, "Z")
    names = ["base", *(f"link{k + 1}" for k in range(len(joints)))]
    for name in names:
        prim = UsdGeom.Xform.Define(stage, f"{root}/{name}").GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(prim)
        mass = UsdPhysics.MassAPI.Apply(prim)
        mass.CreateMassAttr(2.0)
        mass.CreateCenterOfMassAttr((0.125, 0, 0))
        mass.CreateDiagonalInertiaAttr((0.25, 0.5, 0.5))
    UsdPhysics.FixedJoint.Define(stage, f"{root}/root_joint").CreateBody1Rel().SetTargets([f"{root}/base"])
    for k, kind in enumerate(joints):
        joint = kind.Define(stage, f"{root}/joint{k + 1}")
        joint.CreateBody0Rel().SetTargets([f"{root}/{names[k]}"])
        joint.CreateBody1Rel().SetTargets([f"{root}/{names[k + 1]}"])
    return stage


def told(stage: Any, tmp_path: Path, root: str | None = None) -> tuple[Any, str]:
    """The URDF as a tree, and all notes as a text."""
    source, out = tmp_path / "robot.usda", tmp_path / "robot.urdf"
    stage.GetRootLayer().Export(str(source))
    notes = dynid.usd.convert(source, out, root)
    text = out.read_text(encoding="utf-8")
    assert all(f"<!-- {note.replace('--', '- -')} -->" in text for note in notes)
    assert text == dynid.usd.to_urdf(stage, root)
    dynid.Robot.parse(text, "robot.urdf")
    return ElementTree.fromstring(text), "\n".join(notes)


def limits(tree: Any, joint: str) -> dict[str, float]:
    return {key: float(value) for key, value in tree.find(f"joint[@name='{joint}']/limit").attrib.items()}


def attribute(prim: Any, name: str, value: float) -> None:
    prim.CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)


def test_limits_and_notes_on_joints(tmp_path: Path) -> None:
    stage = robot()
    UsdGeom.SetStageMetersPerUnit(stage, 0.5)
    first, second = (stage.GetPrimAtPath(f"/World/Robot/joint{k}") for k in (1, 2))
    for prim, instance in ((first, "angular"), (second, "linear")):
        attribute(prim, "physics:lowerLimit", -90)
        attribute(prim, "physics:upperLimit", 180)
        drive = UsdPhysics.DriveAPI.Apply(prim, instance)
        drive.CreateMaxForceAttr(8)
        drive.CreateStiffnessAttr(400)
        attribute(prim, "physxJoint:maxJointVelocity", 360)
    attribute(first, "physxJoint:armature", 0.125)
    attribute(first, "physxJoint:jointFriction", 0.25)
    tree, notes = told(stage, tmp_path)
    assert limits(tree, "joint1") == {"lower": -math.pi / 2, "upper": math.pi, "effort": 2, "velocity": 2 * math.pi}
    assert limits(tree, "joint2") == {"lower": -45, "upper": 90, "effort": 4, "velocity": 180}
    assert tree.find("joint[@name='joint1']").get("type") == "revolute"
    assert "gains of drives" in notes and "`joint2` drive:linear:physics:stiffness = 400.0" in notes
    assert "no standard place for are left out (as authored): `joint1` physxJoint:armature = 0.125" in notes
    assert "coefficients of PhysX" in notes
    assert "shapes" in notes and "physxJoint:maxJointVelocity" not in notes


def test_joints_without_limits(tmp_path: Path) -> None:
    stage = robot(joints=(UsdPhysics.RevoluteJoint, UsdPhysics.PrismaticJoint, UsdPhysics.RevoluteJoint))
    attribute(stage.GetPrimAtPath("/World/Robot/joint3"), "physics:lowerLimit", 10)
    tree, notes = told(stage, tmp_path)
    assert [joint.get("type") for joint in tree.findall("joint")] == ["fixed", "continuous", "prismatic", "continuous"]
    assert limits(tree, "joint2") == {"effort": 0, "velocity": 0}
    assert "`joint2` slides without limits" in notes and "`joint3`: URDF has no limits like [10.0, inf]" in notes


def test_joints_beside_the_tree_are_left_out(tmp_path: Path) -> None:
    stage = robot(joints=(UsdPhysics.RevoluteJoint,) * 3)
    for name, end in (("loop", "link3"), ("ball", "link2"), ("excluded", "link3"), ("disabled", "link1")):
        kind = UsdPhysics.SphericalJoint if name == "ball" else UsdPhysics.RevoluteJoint
        joint = kind.Define(stage, f"/World/Robot/z{name}")
        joint.CreateBody0Rel().SetTargets(["/World/Robot/base"])
        joint.CreateBody1Rel().SetTargets([f"/World/Robot/{end}"])
        joint.CreateExcludeFromArticulationAttr(name == "excluded")
        joint.CreateJointEnabledAttr(name != "disabled")
    stage.GetPrimAtPath("/World/Robot/joint3").SetActive(False)
    tree, notes = told(stage, tmp_path)
    assert [joint.get("name") for joint in tree.findall("joint")] == ["root_joint", "joint1", "zloop", "joint2"]
    assert "close a loop are left out: `/World/Robot/zball`" in notes
    assert "excluded from the articulation are left out: `/World/Robot/zexcluded`, `/World/Robot/zdisabled`" in notes


def test_joints_of_other_schemas_are_told(tmp_path: Path) -> None:
    stage = robot()
    stage.DefinePrim("/World/Robot/gear", "PhysxPhysicsGearJoint").CreateRelationship("physics:body0").SetTargets(["/World/Robot/link1"])
    assert "`/World/Robot/gear (PhysxPhysicsGearJoint)`" in told(stage, tmp_path)[1]


def test_bodies_without_mass_have_no_inertial(tmp_path: Path) -> None:
    stage = robot()
    stage.GetPrimAtPath("/World/Robot/base").RemoveAPI(UsdPhysics.MassAPI)
    UsdPhysics.MassAPI(stage.GetPrimAtPath("/World/Robot/link1")).CreateMassAttr(0.0)
    UsdPhysics.MassAPI(stage.GetPrimAtPath("/World/Robot/link2")).CreateDiagonalInertiaAttr((0, 0, 0))
    # A body below another one is no part of it.
    tip = UsdGeom.Xform.Define(stage, "/World/Robot/base/tip").GetPrim()
    UsdPhysics.RigidBodyAPI.Apply(tip)
    mass = UsdPhysics.MassAPI.Apply(tip)
    mass.CreateMassAttr(1.0)
    mass.CreateDensityAttr(1000)
    mass.CreateCenterOfMassAttr((0, 0, 0))
    mass.CreateDiagonalInertiaAttr((1, 1, 1))
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/World/Robot/tip_joint")
    joint.CreateBody0Rel().SetTargets(["/World/Robot/base"])
    joint.CreateBody1Rel().SetTargets(["/World/Robot/base/tip"])
    with pytest.warns(dynid.DynidWarning, match="link"):
        tree, notes = told(stage, tmp_path)
    assert [link.get("name") for link in tree.findall("link") if link.find("inertial") is not None] == ["tip"]
    assert "links without `<inertial>`" in notes and "not authored: `base`, `link1`, `link2`" in notes


def test_gravity_and_up_axis_are_told(tmp_path: Path) -> None:
    stage = robot()
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 0.5)
    scene = UsdPhysics.Scene.Define(stage, "/scene")
    assert "gravity" not in told(stage, tmp_path)[1]
    scene.CreateGravityDirectionAttr((0, 0, 1))
    scene.CreateGravityMagnitudeAttr(3)
    notes = told(stage, tmp_path)[1]
    assert "y up" in notes and "`gravity=[0.0, -1.5, 0.0]`" in notes
    assert "metersPerUnit" not in notes
    stage.ClearMetadata("metersPerUnit")
    assert "`metersPerUnit`: its unit of length is 0.01 m" in told(stage, tmp_path)[1]


def test_base_that_nothing_holds(tmp_path: Path) -> None:
    stage = robot()
    stage.GetPrimAtPath("/World/Robot/root_joint").SetActive(False)
    tree, notes = told(stage, tmp_path)
    assert [link.get("name") for link in tree.findall("link")] == ["base", "link1", "link2"]
    assert "no joint holds `/World/Robot/base`" in notes and "floating_base=True" in notes
    UsdGeom.Xform(stage.GetPrimAtPath("/World/Robot/base")).AddRotateXOp().Set(90)
    tree, _ = told(stage, tmp_path)
    assert [link.get("name") for link in tree.findall("link")] == ["upright", "base", "link1", "link2"]
    assert float(tree.find("joint[@name='upright']/origin").get("rpy").split()[0]) == pytest.approx(math.pi / 2, abs=1e-12)


def test_equal_names_are_told_apart(tmp_path: Path) -> None:
    stage = robot()
    UsdGeom.Xform.Define(stage, "/World/Robot/left")
    editor = Usd.NamespaceEditor(stage)
    editor.MovePrimAtPath("/World/Robot/link2", "/World/Robot/left/link1")
    assert editor.ApplyEdits()
    tree, notes = told(stage, tmp_path)
    assert [link.get("name") for link in tree.findall("link")] == ["world", "base", "Robot_link1", "left_link1"]
    assert "`Robot_link1`, `left_link1`" in notes


def test_articulations_are_named(tmp_path: Path) -> None:
    stage = robot("/World/B", robot("/World/A"))
    UsdPhysics.RigidBodyAPI.Apply(UsdGeom.Xform.Define(stage, "/World/box").GetPrim())
    with pytest.raises(dynid.RobotError, match="2 articulations: /World/A, /World/B") as caught:
        dynid.usd.to_urdf(stage)
    assert "--root" in str(caught.value.hint)
    with pytest.raises(dynid.RobotError, match="at or below /World/box") as caught:
        dynid.usd.to_urdf(stage, "/World/box")
    assert "/World/A, /World/B" in str(caught.value.hint)
    tree, _ = told(stage, tmp_path, "/World/B")
    assert tree.get("name") == "B" and len(tree.findall("link")) == 4


def refused(stage: Any, kind: type[dynid.DynidError], what: str, hint: str) -> None:
    with pytest.raises(kind, match=what) as caught:
        dynid.usd.to_urdf(stage)
    assert hint in str(caught.value.hint)


def test_density_in_place_of_a_mass_is_refused() -> None:
    stage = robot()
    mass = UsdPhysics.MassAPI(stage.GetPrimAtPath("/World/Robot/link1"))
    mass.CreateMassAttr(0)
    mass.CreateDensityAttr(1000)
    refused(stage, dynid.RobotError, "/World/Robot/link1.*densities", "author `physics:mass`")
    mass.CreateDensityAttr(0)
    shape = UsdGeom.Sphere.Define(stage, "/World/Robot/link1/shape").GetPrim()
    UsdPhysics.MassAPI.Apply(shape).CreateMassAttr(1)
    refused(stage, dynid.RobotError, "/World/Robot/link1", "author `physics:mass`")


def test_what_has_no_form_is_refused() -> None:
    for kind in (UsdPhysics.SphericalJoint, UsdPhysics.DistanceJoint, UsdPhysics.Joint):
        stage = robot(joints=(UsdPhysics.RevoluteJoint, kind))
        name = stage.GetPrimAtPath("/World/Robot/joint2").GetTypeName()
        refused(stage, dynid.UnsupportedError, f"/World/Robot/joint2.*{name}", "revolute")
    stage = robot()
    UsdGeom.Xform(stage.GetPrimAtPath("/World/Robot/link1")).AddScaleOp().Set((1, -1, 1))
    refused(stage, dynid.UnsupportedError, "/World/Robot/link1.*mirrors", "scale the shapes")
    stage = robot()
    UsdPhysics.RevoluteJoint(stage.GetPrimAtPath("/World/Robot/joint1")).GetBody1Rel().SetTargets(["/World/gone"])
    refused(stage, dynid.RobotError, "/World/Robot/joint1: there is no /World/gone", "mend")
    refused(Usd.Stage.CreateInMemory(), dynid.RobotError, "no joint moves", "PhysicsRigidBodyAPI")


def test_general_joints_that_hold_are_fixed(tmp_path: Path) -> None:
    stage = robot(joints=(UsdPhysics.RevoluteJoint, UsdPhysics.Joint))
    for axis in (f"{motion}{axis}" for motion in ("trans", "rot") for axis in "XYZ"):
        limit = UsdPhysics.LimitAPI.Apply(stage.GetPrimAtPath("/World/Robot/joint2"), axis)
        limit.CreateLowAttr(1)
        limit.CreateHighAttr(-1)
    stage.GetPrimAtPath("/World/Robot/root_joint").SetTypeName("PhysicsJoint")
    tree, notes = told(stage, tmp_path)
    assert [joint.get("type") for joint in tree.findall("joint")] == ["fixed", "continuous", "fixed"]
    assert "joint `root_joint` has no type" in notes and "joint `joint2` has no type" not in notes


def test_without_the_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(dynid.UnsupportedError) as caught:
        dynid.usd.to_urdf(tmp_path / "robot.usd")
    assert caught.value.hint == "pip install usd-core"


def test_command_line(tmp_path: Path) -> None:
    source, out = tmp_path / "robots.usda", tmp_path / "robot.urdf"
    stage = robot("/World/B", robot("/World/A"))
    stage.GetRootLayer().Export(str(source))

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "dynid.usd", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)

    done = run(source, out, "--root", "/World/A")
    assert (done.returncode, done.stdout) == (0, "") and "note: shapes" in done.stderr
    assert dynid.Robot.load(out).joints == ["joint1", "joint2"]
    done = run(source, "--root", "/World/A")
    assert done.returncode == 0 and done.stdout == out.read_text(encoding="utf-8")
    done = run(source)
    assert (done.returncode, done.stdout) == (1, "") and "error: there are 2 articulations" in done.stderr and "hint: " in done.stderr
    (tmp_path / "broken.usda").write_text("#usda 1.0\ndef {", encoding="utf-8")
    for name, reason in (("none.usd", "Failed to open layer"), ("broken.usda", "broken.usda:2:")):
        done = run(tmp_path / name)
        assert done.returncode == 1 and f"{name}: cannot be opened as USD: " in done.stderr
        assert reason in done.stderr and "Traceback" not in done.stderr and "Error in" not in done.stderr
