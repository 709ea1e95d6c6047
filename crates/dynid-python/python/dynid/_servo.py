"""Drives that log commands and positions, and no effort."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._estimate import Progress, teller, written
from ._robot_file import RobotOrPath, as_robot, robot_path
from ._settings import as_json
from ._table import Table


class CommandLog:
    """What drives were told and where their encoders were.

    Parameters
    ----------
    t
        `(n,)` times, s.
    command, q
        `(n, joints)` commanded and measured positions, rad or m.
    velocity, effort
        `(n, joints)` commanded velocities and efforts that were fed forward, where there were some.
    tau, current, dq
        `(n, joints)` measured efforts, N m or N, currents, A, and velocities, where there are some; logs of a robot need not measure the same.
        Velocities count with `fit=["effort", "current", "velocity"]`.
    joints
        Names of the columns. Default: `Robot.joints`, in that order. Joints that are left out stand still at zero.
    name
        Name in messages.
    """

    def __init__(
        self,
        t: ArrayLike,
        command: ArrayLike,
        q: ArrayLike,
        *,
        velocity: ArrayLike | None = None,
        effort: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        current: ArrayLike | None = None,
        dq: ArrayLike | None = None,
        joints: Sequence[str] | None = None,
        name: str = "log",
    ) -> None:
        self.t: NDArray[np.float64] = np.asarray(t, dtype=np.float64)
        if self.t.ndim != 1:
            raise ValueError(f"t: expected a vector of seconds, found shape {self.t.shape}")
        given = {"command": command, "q": q, "velocity": velocity, "effort": effort, "tau": tau, "current": current, "dq": dq}
        self.signals: dict[str, NDArray[np.float64]] = {}
        for what, values in given.items():
            if values is None:
                continue
            table = np.asarray(values, dtype=np.float64)
            table = table[:, None] if table.ndim == 1 else table
            expected = (len(self.t), self.signals["command"].shape[1] if self.signals else table.shape[-1])
            if table.shape != expected:
                raise ValueError(f"{what}: expected shape {expected}, samples by joints, found {np.shape(values)}")
            self.signals[what] = table
        self.joints = None if joints is None else list(joints)
        self.name = name

    def write(self, path: Path, joints: Sequence[str]) -> None:
        """Writes the log as `.npz`, columns by the names of joints."""
        names = list(joints) if self.joints is None else self.joints
        columns = self.signals["q"].shape[1]
        if len(names) != columns:
            raise ValueError(f"joints: expected {columns} names as q has columns, found {len(names)}: {', '.join(names)}")
        unknown = [name for name in names if name not in joints]
        if unknown:
            raise ValueError(f"joints: {', '.join(unknown)} are not joints of the robot: {', '.join(joints)}")
        prefixes = {"command": "cmd", "velocity": "cmd_velocity", "effort": "cmd_effort", "current": "i"}
        signals = {f"{prefixes.get(what, what)}_{joint}": np.ascontiguousarray(table[:, k]) for what, table in self.signals.items() for k, joint in enumerate(names)}
        arrays: dict[str, Any] = {"t": self.t, **signals}
        np.savez(path, **arrays)


class Servo:
    """What was found of drives: gains, rotor inertia, friction, delay, each with an interval and a verdict.

    `record`: the keys of `servo.json`; `files`: what simulators and firmware take, name and text (robot file, `actuators.json`, ...). It pickles.
    """

    def __init__(self, text: str, page: str, files: Mapping[str, str]) -> None:
        self._text = text
        self._page = page
        self.record: dict[str, Any] = json.loads(text)
        self.files = dict(files)

    @property
    def status(self) -> str:
        """`pass`, `warn` or `fail`."""
        return str(self.record["status"])

    @property
    def headline(self) -> str:
        """What it comes down to, in a sentence."""
        return str(self.record["headline"])

    @property
    def joints(self) -> list[str]:
        """Joints, in the order of all lists by joint."""
        return list(self.record["joints"])

    @property
    def warnings(self) -> list[str]:
        """What to know before the numbers are used."""
        return list(self.record["warnings"])

    @property
    def parameters(self) -> Table:
        """A row per parameter: `term`, `joints`, `value`, `low`, `high` (95 %, None where there is no interval), `unit`, `verdict`."""
        rows = []
        for p in self.record["parameters"]:
            low, high = p["interval"] or (None, None)
            rows.append({**p, "joints": ", ".join(p["joints"]), "low": low, "high": high})
        return Table.of_rows(rows, ("term", "joints", "value", "low", "high", "unit", "verdict"))

    def to_json(self) -> str:
        """`servo.json`, byte for byte what the command line writes of the same files."""
        return self._text

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._page)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes `servo.json`, `report.html` and all `files` to a folder."""
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        for name, text in {"servo.json": self._text, "report.html": self._page, **self.files}.items():
            (out / name).write_text(text, encoding="utf-8")

    def __repr__(self) -> str:
        return f"<dynid.Servo of {', '.join(self.joints)}: {self.status}>\n{self.headline}"


LogOfCommands = CommandLog | str | os.PathLike[str]
"""Arrays, or a file."""


def _listed(given: LogOfCommands | Iterable[LogOfCommands]) -> list[LogOfCommands]:
    return [given] if isinstance(given, (CommandLog, str, os.PathLike)) else list(given)


def servo(
    robot: RobotOrPath,
    logs: LogOfCommands | Iterable[LogOfCommands],
    validation: LogOfCommands | Iterable[LogOfCommands] = (),
    *,
    columns: Mapping[str, Any] | None = None,
    command: Mapping[str, Any] | None = None,
    current: str | Mapping[str, Any] | None = None,
    progress: Progress = None,
    threads: int = 0,
    **settings: Any,
) -> Servo:
    """Identifies drives from commands and positions, as `dynid servo` does: position gain, rotor inertia, friction, delay, offsets, zeros.

    `settings` are the keys of `[servo]`: `position_gain=20` where it is known, `velocity_gain`, `effort_limit`, `law=["offset"]`, `hold="line"`, ...
    Efforts and currents that logs measure are met beside the positions; `fit=[]` leaves them alone. `columns`, `command` and `current` say where files have
    positions and efforts, commands, and currents, as in a configuration. `validation`: logs that are predicted only.

    Raises `LogError` for logs that cannot be used, `SettingError` for a setting that is unknown or out of range.
    """
    robot = as_robot(robot)
    options = json.loads(robot.options)
    training, judged = _listed(logs), _listed(validation)
    told = dict(command or {})
    for signal in ("velocity", "effort"):
        if any(signal in log.signals for log in training if isinstance(log, CommandLog)):
            told.setdefault(signal, f"cmd_{signal}_{{joint}}")
    if current is None and any("current" in log.signals for log in training if isinstance(log, CommandLog)):
        current = "i_{joint}"
    with tempfile.TemporaryDirectory() as folder, robot_path(robot) as path:

        def entries(given: list[LogOfCommands], kind: str) -> list[dict[str, str]]:
            out: list[str] = []
            for k, log in enumerate(given):
                if isinstance(log, CommandLog):
                    place = Path(folder) / f"{kind}{k}" / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', log.name)}.npz"
                    place.parent.mkdir()
                    log.write(place, robot.joints)
                    out.append(str(place))
                else:
                    out.extend(os.path.abspath(path) for path in _native.find_logs(os.fspath(log)))
            return [{"path": path} for path in out]

        config = {
            "robot": path,
            "lock": options["locked"],
            "log": entries(training, "log"),
            "validation": entries(judged, "validation"),
            "servo": settings,
            **({"gravity": options["gravity"]} if "gravity" in options else {}),
            **({"columns": dict(columns)} if columns else {}),
            **({"command": told} if told else {}),
            **({"current": current} if current is not None else {}),
        }
        text, page, files = _native.servo(as_json(config), progress=teller(progress), threads=threads)
    return Servo(text, page, dict(files))
