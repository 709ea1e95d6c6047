"""Robots as they are given, and on their way to work that takes them by their file."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import _native
from ._settings import as_json


RobotOrPath = _native.Robot | str | os.PathLike[str]
"""A robot, or the path of one that `Robot.load` reads as it is."""


def as_robot(given: object) -> _native.Robot:
    """A robot that was given as such or by its path; anything else is a `TypeError` that says how a robot is made of it."""
    if isinstance(given, _native.Robot):
        return given
    if isinstance(given, (str, os.PathLike)):
        return _native.Robot.load(given)
    raise TypeError(
        f"robot: expected a `dynid.Robot` or the path of one, found {type(given).__name__}; "
        "a robot of Pinocchio's model is `dynid.Robot.from_pinocchio(model)`, of MuJoCo's `dynid.Robot.from_mujoco(model)`"
    )


@contextmanager
def robot_path(robot: _native.Robot) -> Iterator[str]:
    """The file of a robot; one without a file has one meanwhile."""
    with tempfile.TemporaryDirectory() as folder:
        # What stands behind `#` is no path: it keeps its points and slashes.
        path = os.path.join(os.getcwd(), robot.path)
        if robot.text is not None:
            path = str(Path(folder) / "robot.toml")
            if robot.text.lstrip().startswith("<"):
                path = str(Path(folder) / "robot.urdf")
            Path(path).write_text(robot.text, encoding="utf-8")
        yield path


@contextmanager
def robot_keys(robot: _native.Robot, settings: Mapping[str, Any]) -> Iterator[str]:
    """Settings with the robot and how it was read."""
    clash = {"robot", "gravity", "locked", "couple_mimics"} & set(settings)
    if clash:
        raise TypeError(f"settings: {', '.join(sorted(clash))} belong to the robot, where it is made")
    with robot_path(robot) as path:
        yield as_json({**settings, **json.loads(robot.options), "robot": path})
