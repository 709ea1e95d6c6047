"""Robots by their name in the package `robot_descriptions`."""

from __future__ import annotations

import difflib
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from ._fault import fault
from ._native import DynidWarning, Robot, RobotError, UnsupportedError


def _module(name: str) -> Any:
    try:
        import_module("robot_descriptions")
    except ImportError:
        text = "robot_description: needs the package `robot_descriptions`, which is not installed"
        raise fault(UnsupportedError, text, "pip install robot_descriptions") from None
    known = import_module("robot_descriptions._descriptions").DESCRIPTIONS
    found = next((n for n in (name, f"{name}_description", f"{name}_mj_description") if n in known), None)
    if found is None:
        near = difflib.get_close_matches(name, known, n=5, cutoff=0.4)
        text = f"robot_description: expected a robot of `robot_descriptions`, found {name!r}"
        raise fault(RobotError, text, f"near to it: {', '.join(near)}" if near else "names: `robot_descriptions list`")
    try:
        # Its files are fetched now if they are not there yet.
        return import_module(f"robot_descriptions.{found}")
    except Exception as error:
        text = f"robot_description: {found}: its files cannot be fetched: {error}"
        raise fault(RobotError, text, "it needs Git and the network the first time; ROBOT_DESCRIPTIONS_CACHE says where files lie") from error


@contextmanager
def _packages(folders: Sequence[str]) -> Iterator[None]:
    """Packages that `$(find ..)` may ask for, before those of the user."""
    before = os.environ.get("ROS_PACKAGE_PATH")
    os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join([*folders, *([before] if before else [])])
    try:
        yield
    finally:
        if before is None:
            del os.environ["ROS_PACKAGE_PATH"]
        else:
            os.environ["ROS_PACKAGE_PATH"] = before


def robot_description(
    name: str,
    *,
    arguments: Mapping[str, str] | None = None,
    gravity: Sequence[float] | None = None,
    couple_mimics: bool = False,
    floating_base: bool = False,
    locked: Mapping[str, float] | None = None,
) -> Robot:
    """The robot of this name in the package `robot_descriptions`: `"ur5e_description"`, `"panda_mj_description"`, or `"panda"`.

    A short name is the URDF where there is one, else the MJCF. `arguments` are those of a description in xacro, over the ones that the package
    has for it; the other keywords are those of `Robot.load`. Files that are not there yet are fetched by the package, which needs the network.
    Raises `UnsupportedError` without the package, `RobotError` for a name that it does not have or a file that is not read.
    """
    module = _module(name)
    options: dict[str, Any] = {
        "gravity": gravity,
        "couple_mimics": couple_mimics,
        "floating_base": floating_base,
        "locked": locked,
    }
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if path is not None:
        if arguments:
            text = f"robot_description: {name}: it is no xacro, which alone has arguments"
            raise fault(RobotError, text, "leave `arguments` out")
        return Robot.load(path, **options)
    stated = {**getattr(module, "XACRO_ARGS", {}), **(arguments or {})}
    with _packages(list(getattr(module, "XACRO_PACKAGE_PATHS", {}).values())):
        with warnings.catch_warnings():
            # They are told once, below.
            warnings.simplefilter("ignore", DynidWarning)
            expanded = Robot.load(module.XACRO_PATH, arguments={k: str(v) for k, v in stated.items()})
    # Packages are known here alone, so what is kept is what the file expands to.
    return Robot.parse(expanded.xml or "", f"{module.__name__.rpartition('.')[2]}.urdf", **options)
