"""SDF against Pinocchio: random models whose poses and axes are stated in any of their frames."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest
from numpy.typing import NDArray

pin = pytest.importorskip("pinocchio")

Array = NDArray[np.float64]


class Random:
    """A model in the making, and the same for Pinocchio."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        # Every frame with its place in the model.
        self.frames: dict[str, Any] = {"__model__": pin.SE3.Identity()}
        self.links: list[str] = []
        self.elements: list[str] = []
        self.twin = pin.Model()
        # Joint of the twin that carries a link, and the frame of the link in that of the joint.
        self.carrier: dict[str, tuple[int, Any]] = {}

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def place(self) -> Any:
        return pin.SE3(pin.rpy.rpyToMatrix(self.rng.uniform(-3, 3, 3)), self.rng.uniform(-0.4, 0.4, 3))

    def any_frame(self) -> str:
        return str(self.rng.choice(list(self.frames)))

    def pose(self, place: Any, usual: str) -> str:
        """A place in the model, in a frame of its own choice, or in the one that goes without saying."""
        frame = self.any_frame() if self.chance(0.6) else usual
        named = "" if frame == usual else f' relative_to="{frame}"'
        return self.stated(self.frames[frame].inverse() * place, named)

    def stated(self, place: Any, named: str = "") -> str:
        xyz = " ".join(repr(float(x)) for x in place.translation)
        if self.chance(0.3):
            quaternion = " ".join(repr(float(x)) for x in pin.Quaternion(place.rotation).coeffs())
            return f'<pose rotation_format="quat_xyzw"{named}>{xyz} {quaternion}</pose>'
        rpy = pin.rpy.matrixToRpy(place.rotation)
        if self.chance(0.3):
            return f'<pose degrees="true"{named}>{xyz} {" ".join(repr(float(x)) for x in np.degrees(rpy))}</pose>'
        return f"<pose{named}>{xyz} {' '.join(repr(float(x)) for x in rpy)}</pose>"

    def frame(self, attached_to: str) -> str:
        """A new frame that moves with a link or a frame of it."""
        name, place = f"frame{len(self.frames)}", self.frames[attached_to] * self.place()
        self.elements.append(f'<frame name="{name}" attached_to="{attached_to}">{self.pose(place, attached_to)}</frame>')
        self.frames[name] = place
        return name

    def link(self, place: Any) -> tuple[str, Any]:
        """A link, and its inertia in its own frame for the twin."""
        name = f"link{len(self.links)}"
        mass, com = float(self.rng.uniform(0.1, 5)), self.place()
        root = self.rng.normal(size=(3, 3))
        tensor = root @ root.T * 0.1
        keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        entries = "".join(f"<{key}>{float(tensor[at])!r}</{key}>" for key, at in keys.items())
        inertial = f"<inertial>{self.stated(com)}<mass>{mass!r}</mass><inertia>{entries}</inertia></inertial>"
        self.elements.append(f'<link name="{name}">{self.pose(place, "__model__")}{inertial}</link>')
        self.frames[name] = place
        self.links.append(name)
        turned = com.rotation @ tensor @ com.rotation.T
        return name, pin.Inertia(mass, com.translation, turned)

    def text(self) -> str:
        model_in_world = self.place()
        in_world = self.chance(0.5)
        name, inertia = self.link(self.place())
        root = model_in_world * self.frames[name]
        self.carrier[name] = (0, root)
        if in_world:
            self.elements.append(f'<joint name="stand" type="fixed"><parent>world</parent><child>{name}</child></joint>')
            self.frames["stand"] = self.frames[name]
        for _ in range(int(self.rng.integers(2, 8))):
            self.joint(str(self.rng.choice(self.links)), str(self.rng.choice(["revolute", "continuous", "prismatic", "fixed"])))
        self.joint(name, "revolute")
        self.rng.shuffle(self.elements)
        gravity = self.rng.uniform(-10, 10, 3)
        self.twin.gravity.linear = gravity
        pose = " ".join(repr(float(x)) for x in [*model_in_world.translation, *pin.rpy.matrixToRpy(model_in_world.rotation)])
        model = f'<model name="m"><pose>{pose}</pose>{"".join(self.elements)}</model>'
        stated = " ".join(repr(float(x)) for x in gravity)
        return f'<sdf version="1.9"><world name="w"><gravity>{stated}</gravity>{model}</world></sdf>'

    def joint(self, parent: str, kind: str) -> None:
        place = self.frames[parent] * self.place()
        own = pin.SE3.Identity() if self.chance(0.5) else self.place()
        child, inertia = self.link(place)
        name, in_model = f"joint{len(self.links)}", place * own
        ends = [self.frame(link) if self.chance(0.3) else link for link in (parent, child)]
        pose = "" if own == pin.SE3.Identity() and ends[1] == child else self.pose(in_model, ends[1])
        axis = self.rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        said, named = axis, ""
        if self.chance(0.5):
            frame = self.any_frame()
            said = self.frames[frame].rotation.T @ in_model.rotation @ axis
            named = f' expressed_in="{frame}"'
        xyz = " ".join(repr(float(x)) for x in said)
        turning = "" if kind == "fixed" else f"<axis><xyz{named}>{xyz}</xyz></axis>"
        self.elements.append(f'<joint name="{name}" type="{kind}">{pose}<parent>{ends[0]}</parent><child>{ends[1]}</child>{turning}</joint>')
        self.frames[name] = in_model
        carrier, of_link = self.carrier[parent]
        at = of_link * self.frames[parent].inverse() * in_model
        if kind == "fixed":
            self.carrier[child] = (carrier, at * own.inverse())
        else:
            model = pin.JointModelPrismaticUnaligned(axis) if kind == "prismatic" else pin.JointModelRevoluteUnaligned(axis)
            self.carrier[child] = (self.twin.addJoint(carrier, model, at, name), own.inverse())
        joint, frame_of = self.carrier[child]
        if joint > 0:
            self.twin.appendBodyToJoint(joint, inertia, frame_of)


@pytest.mark.parametrize("seed", range(100))
@pytest.mark.filterwarnings("ignore::dynid.DynidWarning")
def test_random_models_have_the_efforts_of_pinocchio(seed: int, tmp_path: Path) -> None:
    random = Random(seed)
    file = tmp_path / "model.sdf"
    file.write_text(random.text(), encoding="utf-8")
    robot, model = dynid.Robot.load(file), random.twin
    assert sorted(robot.joints) == sorted(list(model.names)[1:])
    place = [robot.joints.index(name) for name in list(model.names)[1:]]
    rng, data = np.random.default_rng(seed), model.createData()
    q, v, a = (rng.uniform(-2, 2, (20, model.nv)) for _ in range(3))
    theirs = np.array([pin.rnea(model, data, *x).copy() for x in zip(q, v, a, strict=True)])
    back = np.argsort(place)
    ours = robot.inverse_dynamics(q[:, back], v[:, back], a[:, back])
    assert np.abs(ours - theirs[:, back]).max() <= 1e-12 * np.abs(theirs).max()


def test_a_robot_is_named_behind_its_file(tmp_path: Path) -> None:
    file = tmp_path / "world.sdf"
    link = '<link name="base"/><link name="arm"/><joint name="{0}" type="revolute"><parent>base</parent><child>arm</child></joint>'
    models = "".join(f'<model name="{name}">{link.format("j" + name)}</model>' for name in "ab")
    file.write_text(f'<sdf version="1.9"><world name="w">{models}</world></sdf>', encoding="utf-8")
    with pytest.warns(dynid.DynidWarning, match="no <inertial>"):
        assert list(dynid.Robot.load(f"{file}#b").joints) == ["jb"]
    with pytest.raises(dynid.RobotError, match="FILE#a"):
        dynid.Robot.load(file)
