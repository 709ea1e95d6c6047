"""Random MJCF models for the tests of `Robot.load`: every feature that is read, from a seed."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np


def number(x: Any) -> str:
    return repr(round(float(x), 6))


def numbers(xs: Iterable[Any]) -> str:
    return " ".join(number(x) for x in xs)


class Random:
    """A model in the making."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.seed = seed
        self.degree = self.chance(0.5)
        self.joints = 0
        self.bodies = 0
        self.sequence = "".join(self.rng.choice(list("xyzXYZ"), 3))
        self.groups = self.chance(0.3)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def uniform(self, low: float, high: float, count: Any = None) -> Any:
        return self.rng.uniform(low, high, count)

    def angle(self, low: float, high: float, count: Any = None) -> Any:
        x = self.uniform(low, high, count)
        return np.degrees(x) if self.degree else x

    def orientation(self) -> str:
        kind = self.rng.integers(6)
        if kind == 0:
            return ""
        if kind == 1:
            return f' quat="{numbers(self.uniform(-1, 1, 4))}"'
        if kind == 2:
            return f' axisangle="{numbers(self.uniform(-1, 1, 3))} {number(self.angle(-3, 3))}"'
        if kind == 3:
            return f' euler="{numbers(self.angle(-3, 3, 3))}"'
        if kind == 4:
            return f' xyaxes="{numbers(self.uniform(-1, 1, 6))}"'
        return f' zaxis="{numbers(self.uniform(-1, 1, 3))}"'

    def place(self) -> str:
        return f' pos="{numbers(self.uniform(-0.3, 0.3, 3))}"{self.orientation()}'

    def geom(self) -> str:
        kind = self.rng.choice(["sphere", "capsule", "cylinder", "box", "ellipsoid"])
        size = self.uniform(0.02, 0.2, 3)
        text = f'<geom type="{kind}"' if kind != "sphere" or self.chance(0.5) else "<geom"
        if kind != "sphere" and self.chance(0.3):
            text += f' fromto="{numbers(self.uniform(-0.3, 0.3, 6))}" size="{number(size[0])}"'
        else:
            count = {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)
            text += f' size="{numbers(size[:count])}"{self.place()}'
        if self.chance(0.3):
            text += f' mass="{number(self.uniform(0.1, 3))}"'
        elif self.chance(0.3):
            text += f' density="{number(self.uniform(200, 3000))}"'
        if self.chance(0.15):
            text += ' class="heavy"'
        if self.chance(0.2) and kind != "ellipsoid":
            text += ' shellinertia="true"'
        if self.chance(0.2):
            text += f' group="{self.rng.integers(0, 6)}"'
        return text + "/>"

    def mesh(self) -> str:
        return f'<geom type="mesh" mesh="{self.rng.choice(["wedge", "tetra", "bowl"])}"{self.place()}/>'

    def inertial(self) -> str:
        mass = self.uniform(0.2, 4)
        a, b = self.uniform(0.01, 0.05, 2)
        c = self.uniform(abs(a - b) + 1e-3, a + b - 1e-3)
        text = f'<inertial pos="{numbers(self.uniform(-0.1, 0.1, 3))}" mass="{number(mass)}"'
        if self.chance(0.5):
            return f'{text} diaginertia="{numbers([a, b, c])}"{self.orientation()}/>'
        q, _ = np.linalg.qr(self.uniform(-1, 1, (3, 3)))
        t = q @ np.diag([a, b, c]) @ q.T
        return f'{text} fullinertia="{numbers([t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]])}"/>'

    def joint(self) -> str:
        self.joints += 1
        slides = self.chance(0.3)
        unit = (lambda x: x) if slides or not self.degree else np.degrees
        text = f'<joint name="j{self.joints}"' if self.chance(0.9) else "<joint"
        if slides:
            text += ' type="slide"'
        if self.chance(0.8):
            text += f' axis="{numbers(self.uniform(-1, 1, 3))}"'
        if self.chance(0.6):
            text += f' pos="{numbers(self.uniform(-0.2, 0.2, 3))}"'
        if self.chance(0.4):
            text += f' ref="{number(unit(self.uniform(-1, 1)))}"'
        if self.chance(0.5):
            text += f' range="{numbers(unit(np.array([-1.5, 2.0])))}"'
        if self.chance(0.3):
            text += f' armature="{number(self.uniform(0.01, 0.5))}"'
        if self.chance(0.3):
            text += f' damping="{number(self.uniform(0.1, 2))}"'
        if self.chance(0.3):
            text += f' frictionloss="{number(self.uniform(0.1, 2))}"'
        if self.chance(0.2):
            text += f' stiffness="{number(self.uniform(1, 20))}" springref="{number(unit(0.3))}"'
        if self.chance(0.2):
            text += ' actuatorfrcrange="-7 9"'
        if self.chance(0.2):
            text += ' class="heavy"'
        return text + "/>"

    def body(self, depth: int) -> str:
        self.bodies += 1
        name = f' name="b{self.bodies}"' if self.chance(0.9) else ""
        childclass = f' childclass="{self.rng.choice(["arm", "heavy"])}"' if self.chance(0.2) else ""
        parts = []
        joints = int(self.rng.choice([0, 1, 1, 1, 2, 3]))
        if depth == 0:
            joints = max(joints, 1)
        parts += [self.joint() for _ in range(joints)]
        explicit = self.chance(0.3)
        if explicit:
            parts.append(self.inertial())
        shapes = [self.geom() for _ in range(self.rng.integers(1, 4))]
        # A shape that counts in every model, so that every body has mass.
        shapes.append(
            f'<geom type="box" size="{numbers(self.uniform(0.02, 0.1, 3))}"{self.place()} group="1" mass="{number(self.uniform(0.2, 1))}"/>'
        )
        if self.chance(0.25):
            shapes.append(self.mesh())
        parts += shapes
        parts += ['<site pos="0 0 1"/>', "<camera/>"] if self.chance(0.2) else []
        if depth < 4:
            count = int(self.rng.choice([0, 1, 1, 2])) if depth else 1
            for _ in range(count):
                parts.append(self.body(depth + 1))
        if self.chance(0.3) and len(parts) > 2:
            k = int(self.rng.integers(1, len(parts)))
            cls = ' childclass="arm"' if self.chance(0.5) else ""
            parts[k:] = [f"<frame{self.place()}{cls}>", *parts[k:], "</frame>"]
        if depth == 2 and self.chance(0.25):
            euler = numbers(self.angle(-1, 1, 3))
            parts.append(
                f'<replicate count="{self.rng.integers(2, 4)}" offset="{numbers(self.uniform(-0.1, 0.1, 3))}" euler="{euler}" sep="-">'
                f'<body name="copy{self.bodies}"{self.place()}><joint name="turn{self.bodies}"/><geom size=".05"/></body></replicate>'
            )
        return "\n".join([f"<body{name}{self.place()}{childclass}>", *parts, "</body>"])

    def text(self) -> str:
        settings = [f'angle="{"degree" if self.degree else "radian"}"', f'eulerseq="{self.sequence}"']
        if self.degree and self.chance(0.5):
            settings[0] = ""
        settings.append(f'inertiafromgeom="{self.rng.choice(["auto", "auto", "true"])}"')
        if self.groups:
            settings.append('inertiagrouprange="0 3"')
        if self.chance(0.2):
            settings.append('boundmass="0.5" boundinertia="0.004"')
        if self.chance(0.2):
            settings.append('balanceinertia="true"')
        if self.chance(0.15):
            settings.append('settotalmass="17"')
        unit = np.degrees(1) if self.degree else 1.0
        free = self.chance(0.15)
        world = [self.body(0) for _ in range(self.rng.integers(1, 3))]
        if free:
            world.append(
                '<body name="free" pos="0 0 2" euler="0 0 1"><freejoint name="float"/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/>'
                + self.body(2)
                + "</body>"
            )
        world.append(f'<body name="still"{self.place()}><geom type="box" size="1 1 1"/>{self.body(0)}</body>')
        return f'''<mujoco model="random {self.seed}">
  <compiler {" ".join(settings)}/>
  <option gravity="{numbers(self.uniform(-10, 10, 3))}"/>
  <default>
    <geom density="700" {'size="0.05 0.06 0.07"' if self.chance(0.5) else ""}/>
    <joint armature="0.02" {f'ref="{number(0.2 * unit)}"' if self.chance(0.3) else ""}/>
    <mesh scale="0.7 1.1 0.9"/>
    <default class="arm"><geom density="1500"/><joint damping="0.3" axis="0 1 0"/>
      <default class="heavy"><geom mass="2"/><joint frictionloss="0.2" pos="0.01 0.02 0.03"/></default>
    </default>
  </default>
  <asset>
    <mesh name="wedge" file="wedge.stl"/>
    <mesh name="tetra" vertex="0 0 0 0.2 0 0 0 0.3 0 0 0 0.25" face="0 2 1 0 1 3 0 3 2 1 2 3" inertia="exact"/>
    <mesh name="bowl" file="bowl.obj" scale="-0.5 0.6 0.7" refpos="0.01 0.02 0.03" refquat="0.9 0.1 0.2 0.3"
      inertia="{self.rng.choice(["legacy", "shell"])}"/>
  </asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    {chr(10).join(world)}
  </worldbody>
</mujoco>
'''


def write_meshes(folder: Path) -> None:
    # A wedge: a prism over a triangle.
    p = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.25], [0.3, 0, 0.25], [0, 0.2, 0.2]])
    f = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    with open(folder / "wedge.stl", "wb") as out:
        out.write(b"\0" * 80 + struct.pack("<I", len(f)))
        for t in f:
            out.write(struct.pack("<12fH", 0, 0, 0, *p[t[0]], *p[t[1]], *p[t[2]], 0))
    # A bowl: a body that is not convex.
    p = np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0], [0, 0.2, 0], [0, 0, 0.2], [0.2, 0, 0.2], [0.2, 0.2, 0.2], [0, 0.2, 0.2], [0.1, 0.1, 0.05]])
    f = [
        (0, 3, 2),
        (0, 2, 1),
        (0, 1, 5),
        (0, 5, 4),
        (1, 2, 6),
        (1, 6, 5),
        (2, 3, 7),
        (2, 7, 6),
        (3, 0, 4),
        (3, 4, 7),
        (4, 5, 8),
        (5, 6, 8),
        (6, 7, 8),
        (7, 4, 8),
    ]
    with open(folder / "bowl.obj", "w") as out:
        out.writelines(f"v {a} {b} {c}\n" for a, b, c in p)
        out.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in f)
