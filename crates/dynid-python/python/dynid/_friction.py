"""Friction experiments: single joints at constant speeds, and moved within their friction."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

from . import _native
from ._estimate import Progress, native_logs, teller, written
from ._log import LogOrPath, as_list
from ._robot_file import RobotOrPath, as_robot
from ._settings import as_json
from ._table import Table


class FrictionLog(NamedTuple):
    """A log of one joint at constant speeds, forth and back; or of friction itself.

    `joint`: the joint that moves (default: every joint that moves while the others rest). `signal="friction"`: efforts are friction
    already, that is efforts less a model of everything else. Temperatures are channels of the log, `temperature_<joint>` in °C.
    """

    log: LogOrPath
    joint: str | None = None
    signal: Literal["effort", "friction"] = "effort"


class PreslidingLog(NamedTuple):
    """A log of one joint that an effort moves within its friction, from rest.

    `inertia`: all that moves with the joint in this pose, kg m² or kg. `offset`: constant effort in this pose, N m or N. `effort_hold`: the effort
    between its samples (`auto`: whichever fits better).
    """

    log: LogOrPath
    joint: str
    inertia: float
    offset: float = 0.0
    effort_hold: Literal["auto", "held", "linear"] = "auto"


class Friction:
    """Friction of single joints by speed and temperature, with what logs could not tell.

    `record`: the keys of `friction.json`.
    """

    def __init__(self, text: str, page: str) -> None:
        self._text = text
        self._page = page
        self.record: dict[str, Any] = json.loads(text)

    @property
    def status(self) -> str:
        """`pass`, `warn` or `fail`."""
        return str(self.record["verdict"]["status"])

    @property
    def headline(self) -> str:
        """What it comes down to, in a sentence."""
        return str(self.record["verdict"]["headline"])

    @property
    def warnings(self) -> list[str]:
        """What to know before the numbers are used."""
        return list(self.record["warnings"])

    @property
    def joints(self) -> Table:
        """A row per joint of a test.

        Columns: `joint`, `status`, `coulomb` and `static` (N m or N), `stribeck_speed` (rad/s or m/s), `viscous` (its coefficients), `offset`, `bristle` (stiffness
        `sigma0`, damping `sigma1`), `residual_rms`, `largest_error` (share), `notes`."""
        names = ("joint", "status", "coulomb", "static", "stribeck_speed", "viscous", "offset", "bristle", "residual_rms", "largest_error", "notes")
        return Table.of_rows(self.record["joints"], names)

    @property
    def points(self) -> Table:
        """A row per point that a law was fitted to: `joint`, `speed`, `temperature` (°C, None where it was not logged), `friction` and `std` (N m or N)."""
        rows = [{"joint": joint["joint"], **point} for joint in self.record["joints"] for point in joint["points"]]
        return Table.of_rows(rows, ("joint", "speed", "temperature", "friction", "std"))

    def to_json(self) -> str:
        """`friction.json`."""
        return self._text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `friction.json`, which `identify(.., elements={"known_friction": path})` takes; it appears whole or not at all."""
        written(path, self._text)

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._page)

    def __repr__(self) -> str:
        return f"<dynid.Friction: {self.status}>\n{self.headline}"


def friction(
    robot: RobotOrPath,
    logs: LogOrPath | FrictionLog | Iterable[LogOrPath | FrictionLog],
    presliding: PreslidingLog | Iterable[PreslidingLog] = (),
    *,
    progress: Progress = None,
    threads: int = 0,
    **settings: Any,
) -> Friction:
    """Finds the friction of single joints from experiments, as `dynid friction` does.

    Half the difference of the efforts of both directions at the same position is friction; a law is fitted to it over speed and, where
    temperatures are logged, over temperature. Logs of pre-sliding give stiffness and damping of LuGre's bristles (Canudas de Wit 1995).

    `settings`: the keys of a friction file: `law="stribeck_viscous"`, `thermal_lines="none"`, `reference_temperature=25`,
    `constant_speed={"trim_s": 0.2}`, `pairs={...}`, `prior={"j1": {"sigma0": 1e5, "sigma1": 300}}`.

    One direction only, too few speeds and coarse encoders are outcomes that say so. Raises `LogError` where no log holds a stretch of constant
    speed, `SettingError` for a setting that is unknown or out of range.
    """
    clash = {"robot", "log", "presliding", "columns", "out"} & set(settings)
    if clash:
        raise TypeError(f"settings: {', '.join(sorted(clash))}: robot and logs are arguments, columns belong to `Log.read`, results are values")
    steady = [logs] if isinstance(logs, FrictionLog) else as_list(logs)
    tests = [test if isinstance(test, FrictionLog) else FrictionLog(test) for test in steady]
    slow = [presliding] if isinstance(presliding, PreslidingLog) else list(presliding)

    def entries(given: Iterable[FrictionLog | PreslidingLog]) -> list[dict[str, Any]]:
        return [{key: value for key, value in test._asdict().items() if key != "log" and value is not None} for test in given]

    text = as_json({**settings, "log": entries(tests), "presliding": entries(slow)})
    natives = native_logs(test.log for test in tests), native_logs(test.log for test in slow)
    return Friction(*_native.friction(as_robot(robot), natives[0], natives[1], text, progress=teller(progress), threads=threads))
