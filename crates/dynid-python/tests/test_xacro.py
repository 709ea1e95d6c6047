"""Xacro against ROS's own: random robots whose numbers are random expressions, and robots by name."""

from __future__ import annotations

import os
import sys
import types
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest

REST = '<link name="b"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'


class Expressions:
    """Random expressions of numbers, of which some have no value."""

    def __init__(self, seed: int, names: list[str]) -> None:
        self.rng = np.random.default_rng(seed)
        self.names = names

    def of(self, *choices: str) -> str:
        return str(self.rng.choice(list(choices)))

    def number(self) -> str:
        kind = self.rng.integers(5)
        if kind == 0:
            return str(self.rng.integers(0, 12))
        if kind == 1:
            return repr(round(float(self.rng.uniform(0, 4)), 3))
        if kind == 2:
            return self.of("pi", "math.pi", "e", "True", "2e-3", "0x1f")
        return self.of(*self.names)

    def value(self, depth: int) -> str:
        if depth == 0:
            return self.number()

        def a() -> str:
            return self.value(depth - 1)

        b = c = a
        kind = self.rng.integers(13)
        if kind < 4:
            return f"{a()} {self.of('+', '-', '*', '/', '//', '%')} {b()}"
        if kind == 4:
            return f"({a()}) {self.of('*', '-', '%', '//')} ({b()})"
        if kind == 5:
            return f"-{self.number()} ** {self.of('2', '3')}"
        if kind == 6:
            return f"{self.of('sin', 'cos', 'radians', 'math.degrees', 'math.floor', 'python.abs', 'int', 'atan')}({a()})"
        if kind == 7:
            return f"{self.of('max', 'min')}({a()}, {b()}, {c()})"
        if kind == 8:
            return f"({a()} if {b()} {self.of('&lt;', '&gt;=', '==', '!=')} {c()} else {self.number()})"
        if kind == 9:
            return f"python.sum([x * {self.number()} for x in python.range({self.rng.integers(1, 5)}) if x % 2 {self.of('==', '!=')} 0])"
        if kind == 10:
            return f"[{a()}, {b()}, {c()}][{self.of('0', '1', '-1', '1:')}]" if self.rng.random() < 0.3 else f"({a()}, {b()})[{self.of('0', '-2')}]"
        if kind == 11:
            return f"round({a()}, {self.rng.integers(0, 4)})"
        return f"({a()} {self.of('and', 'or')} {b()})"


def plain(text: str, tmp_path: Path) -> Any:
    """The document that ROS's xacro makes of a text, or `None` where it refuses it."""
    xacro = pytest.importorskip("xacro")
    file = tmp_path / "reference.xacro"
    file.write_text(text)
    try:
        return xacro.process_file(str(file))
    except Exception:
        return None


def test_expressions_have_the_values_of_python(tmp_path: Path) -> None:
    compared = refused = 0
    for seed in range(40):
        stated = "".join(
            f'<xacro:property name="p{k}" value="{v}"/>' for k, v in enumerate(("2", "0.75", "-3", "${p0 * p1}", "1e2", "${[1, 2.5][1]}"))
        )
        make = Expressions(seed, [f"p{k}" for k in range(6)])
        for _ in range(40):
            expression = make.value(3)
            text = f'{HEAD}{stated}<link name="a" v="${{{expression}}}"/>{REST}</robot>'
            reference = plain(text, tmp_path)
            if reference is None:
                refused += 1
                with pytest.raises(dynid.RobotError, match="r.xacro:1:"):
                    dynid.Robot.parse(text, "r.xacro")
                continue
            expected = reference.getElementsByTagName("link")[0].getAttribute("v")
            if "j" in expected:
                continue  # complex numbers, which robots do not have
            found = dynid.Robot.parse(text, "r.xacro").xml or ""
            value = found.split(' v="')[1].split('"')[0]
            try:
                assert float(value) == pytest.approx(float(expected), rel=1e-14, abs=1e-300, nan_ok=True), expression
                assert ("." in value or "e" in value or "n" in value) == ("." in expected or "e" in expected or "n" in expected), expression
            except ValueError:
                assert value == expected, expression
            compared += 1
    assert compared > 1000 and refused > 20, (compared, refused)


def arm(seed: int) -> str:
    """An arm of macros: parameters with defaults, blocks, conditions, properties that wait, lists and dictionaries."""
    rng = np.random.default_rng(seed)

    def number() -> str:
        return repr(float(rng.uniform(0.1, 2.0)))

    calls = "".join(
        f'<xacro:link_and_joint n="{k}" mass="{number()}" {f"size={chr(34)}{number()}{chr(34)}" if rng.random() < 0.5 else ""}>'
        f'<origin xyz="${{side * {number()}}} {number()} ${{size}}" rpy="0 ${{radians({rng.integers(-90, 90)})}} 0"/>'
        f"</xacro:link_and_joint>"
        for k in range(1, 7)
    )
    return f"""{HEAD}
  <xacro:arg name="side" default="left"/>
  <xacro:property name="side" value="${{1 if '$(arg side)' == 'left' else -1}}"/>
  <xacro:property name="size" value="{number()}"/>
  <xacro:property name="shares" value="${{dict(mass=[0.4, 0.6], far=density / 1000)}}"/>
  <xacro:property name="density" value="{rng.integers(500, 3000)}"/>
  <xacro:macro name="cylinder" params="mass radius:=0.05 length:=^|0.3 *origin">
    <inertial><xacro:insert_block name="origin"/><mass value="${{mass * shares['mass'][0] + mass * shares.get('none', 0.6)}}"/>
      <inertia ixx="${{mass * (3 * radius**2 + length**2) / 12}}" ixy="0" ixz="0" iyy="${{mass * (3 * radius**2 + length**2) / 12}}" iyz="0"
        izz="${{mass * radius**2 / 2}}"/></inertial>
  </xacro:macro>
  <xacro:macro name="link_and_joint" params="n mass size:=${{size / 2}} *place">
    <xacro:property name="length" value="${{size * shares['far']}}"/>
    <link name="l${{n}}"><xacro:cylinder mass="${{mass}}"><xacro:insert_block name="place"/></xacro:cylinder></link>
    <joint name="j${{n}}" type="revolute"><parent link="l${{n - 1}}"/><child link="l${{n}}"/><xacro:insert_block name="place"/>
      <xacro:if value="${{n % 2 == 0}}"><axis xyz="0 0 1"/></xacro:if><xacro:unless value="${{n % 2 == 0}}"><axis xyz="0 1 0"/></xacro:unless>
      <limit lower="-3" upper="3" effort="10" velocity="2"/></joint>
  </xacro:macro>
  <link name="l0"/>{calls}</robot>"""


@pytest.mark.parametrize("seed", range(10))
def test_arms_of_macros_are_those_of_ros(seed: int, tmp_path: Path) -> None:
    xacro = pytest.importorskip("xacro")
    file = tmp_path / "arm.urdf.xacro"
    file.write_text(arm(seed))
    for side in ("left", "right"):
        reference = dynid.Robot.parse(xacro.process_file(str(file), mappings={"side": side}).toxml(), "reference.urdf")
        ours = dynid.Robot.load(file, arguments={"side": side})
        assert ours.joints == reference.joints
        q, v, a = np.random.default_rng(1).uniform(-2, 2, (3, 20, 6))
        expected = reference.inverse_dynamics(q, v, a)
        assert np.max(np.abs(ours.inverse_dynamics(q, v, a) - expected)) <= 1e-12 * np.max(np.abs(expected))


def test_a_robot_in_xacro_is_identified_and_given_back_as_urdf(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf.xacro"
    file.write_text(arm(3))
    robot = dynid.Robot.load(file, arguments={"side": "right"})
    made = dynid.simulate(robot, duration_s=20, rate_hz=200, seed=2, values={f"{j}.fc": 0.5 for j in robot.joints})
    found = dynid.identify(robot, made.log)
    urdf = dynid.Robot.parse(found.to_urdf(), "found.urdf")
    assert urdf.joints == robot.joints and "xacro" not in (urdf.xml or "")
    # A text keeps what it expands to, since what it names may be elsewhere later.
    kept = dynid.Robot.parse(arm(3), "arm.urdf.xacro")
    assert str(kept.path) == "arm.urdf" and "xacro:" not in (kept.text or "<xacro:")


def test_robots_come_by_their_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a package in place of `robot_descriptions`, which would fetch its files from the network."""
    own = tmp_path / "own_description"
    (own / "urdf").mkdir(parents=True)
    (own / "package.xml").write_text("<package><name>own_description</name></package>")
    (own / "urdf" / "parts.xacro").write_text(f'{HEAD}<xacro:macro name="base" params="n"><link name="${{n}}"/></xacro:macro></robot>')
    (own / "urdf" / "own.urdf.xacro").write_text(
        f'{HEAD}<xacro:arg name="side" default="?"/><xacro:include filename="$(find own_description)/urdf/parts.xacro"/><xacro:base n="$(arg side)"/>'
        '<link name="tip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        '<joint name="turn" type="continuous"><parent link="$(arg side)"/><child link="tip"/></joint></robot>'
    )
    elsewhere = tmp_path / "elsewhere.urdf.xacro"
    elsewhere.write_text((own / "urdf" / "own.urdf.xacro").read_text())
    package = types.ModuleType("robot_descriptions")
    package.__path__ = []
    names = types.ModuleType("robot_descriptions._descriptions")
    names.DESCRIPTIONS = {"own_description": None, "plain_description": None}  # type: ignore[attr-defined]
    described = types.ModuleType("robot_descriptions.own_description")
    described.XACRO_PATH = str(elsewhere)  # type: ignore[attr-defined]
    described.XACRO_ARGS = {"side": "left"}  # type: ignore[attr-defined]
    described.XACRO_PACKAGE_PATHS = {"own_description": str(own)}  # type: ignore[attr-defined]
    for name, module in (("", package), ("._descriptions", names), (".own_description", described)):
        monkeypatch.setitem(sys.modules, f"robot_descriptions{name}", module)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)

    robot = dynid.robot_description("own")
    assert robot.joints == ["turn"] and "left" in (robot.text or "")
    assert "right" in (dynid.robot_description("own_description", arguments={"side": "right"}).text or "")
    assert "ROS_PACKAGE_PATH" not in os.environ
    with pytest.raises(dynid.RobotError, match="near to it: own_description"):
        dynid.robot_description("own_descriptoin")
    with pytest.raises(dynid.RobotError, match="cannot be fetched"):
        dynid.robot_description("plain")
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    with pytest.raises(dynid.UnsupportedError, match="pip install robot_descriptions"):
        dynid.robot_description("own")
