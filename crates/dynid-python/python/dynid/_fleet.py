"""Fleets: logs of many robots, reduced anywhere, and what they say together."""

from __future__ import annotations

import html
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from datetime import date, datetime, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any, TypedDict

from . import _native
from ._estimate import Estimate, Factor, Progress, _write, teller, written
from ._log import Log
from ._settings import as_json
from ._table import Table

Recipe = bytes | Factor | str | os.PathLike[str]
"""A recipe: the bytes of a factor file, a `Factor`, or the path of a factor file. Logs inside play no part."""

Start = float | str | date | datetime
"""When a log began: seconds since 1970, a date as manifests state it, or a date with its offset from UTC."""


class ManifestRow(TypedDict):
    """A log of a manifest: its name there, its path, its robot, its start (s since 1970 or None), and the numbers that hold for all of it."""

    log: str
    path: str
    robot: str
    start: float | None
    covariates: dict[str, float]


def read_manifest(path: str | os.PathLike[str]) -> list[ManifestRow]:
    """The logs of a manifest: a CSV table with the columns `log` and `robot`, and if need be `start` and numbers that hold for whole logs.

    Raises `DynidError` with row and column for what cannot be read.
    """
    rows: list[ManifestRow] = json.loads(_native.read_manifest(os.fspath(path)))
    return rows


def reduce_log(
    log: str | os.PathLike[str] | Log,
    recipe: Recipe,
    *,
    robot: str,
    start: Start | None = None,
    covariates: Mapping[str, float] | None = None,
    name: str | None = None,
) -> bytes:
    """Reduces one log by a recipe, and gives what a `FactorStore` keeps of it.

    That is a factor file of a few kilobytes, or for a log that cannot be reduced the JSON of the failure (`log`, `robot`, `code`, `message`, `hint`).
    Bad data raise nothing. The same log, name, origin and recipe give the same bytes, wherever the file lies; they may be made by any process and
    travel any way.

    Parameters
    ----------
    log
        A log file of any format that the command line reads, `FILE#MEMBER` for a part of one, read as the logs that taught the recipe. Or a `Log`.
    recipe
        Which columns, kernel, mask and delay: the bytes of a factor file, a `Factor`, or a path.
    robot
        Name or serial number of the robot.
    start
        When the log began. Without it the log says nothing of changes with time.
    covariates
        Numbers that hold for the whole log, by name: temperature, load, age.
    name
        Name in results and messages. Default: the path as given; `log` for arrays.

    Raises `EstimateError` or `OSError` for a recipe that cannot be read, `ValueError` or `TypeError` for other arguments.
    """
    path = "" if isinstance(log, Log) else os.fspath(log)
    row = _row({"log": name or path or "log", "path": path, "robot": robot, "start": start, "covariates": covariates})
    return _reducer(_recipe(recipe)).reduce(as_json(row), log._native if isinstance(log, Log) else None)


class FactorStore:
    """A folder of factors by one recipe, a file per log, filled by any number of processes; the same that `dynid reduce --manifest` fills.

    Files are named by content: what was reduced how. What is put twice is there once; what was killed is there whole or not at all.

    Parameters
    ----------
    folder
        The folder. It is made if it is not there and a recipe is given.
    recipe
        As in `reduce_log`. Default: the one that the folder has.

    Raises `DynidError` for a folder with factors of another recipe, or without any if none is given.
    """

    def __init__(self, folder: str | os.PathLike[str], recipe: Recipe | None = None) -> None:
        self._native = _native.FactorStore(os.fspath(folder), None if recipe is None else _recipe(recipe))

    @property
    def folder(self) -> Path:
        """The folder."""
        return Path(self._native.folder)

    @property
    def recipe(self) -> bytes:
        """The recipe as a factor file without logs: what `reduce_log` takes, wherever it runs."""
        return self._native.recipe

    def put(self, made: bytes) -> dict[str, Any] | None:
        """Keeps what `reduce_log` made; gives the failure if that is one.

        Of a log that could not be opened nothing is kept: it may come. Raises `DynidError` for other bytes, or those of another recipe.
        """
        text = self._native.put(made)
        return None if text is None else json.loads(text)

    def fail(self, name: str, robot: str, message: str) -> dict[str, Any]:
        """Names a log whose process ended without a result when it had that log alone; gives the failure. It is forgotten once the log is there."""
        failure: dict[str, Any] = json.loads(self._native.fail(name, robot, message))
        return failure

    def reduce(
        self,
        manifest: str | os.PathLike[str] | Iterable[Mapping[str, Any]],
        *,
        progress: Progress = None,
        threads: int = 0,
    ) -> dict[str, Any]:
        """Reduces the logs of a manifest (its path, or rows as `read_manifest` gives them) that are not there yet, several at a time.

        Rows need `log` and `robot`; without `path` the log lies where its name says. Gives the numbers of `logs`, `reduced` and `known`, and
        the list of `failures`. `threads`: 0 for all cores.
        """
        if isinstance(manifest, (str, os.PathLike)):
            rows: list[Any] = list(read_manifest(manifest))
        else:
            rows = [_row(row) for row in manifest]
        found: dict[str, Any] = json.loads(self._native.reduce(as_json(rows), progress=teller(progress), threads=threads))
        return found

    @property
    def failures(self) -> Table:
        """Logs that could not be reduced or read, and why."""
        return _failures(json.loads(self._native.failures()))

    def __len__(self) -> int:
        """Number of logs whose factors are there."""
        return len(self._native)

    def __repr__(self) -> str:
        return f"<dynid.FactorStore {self.folder}: {len(self)} logs>"


class Fleet:
    """What the logs of a fleet say together: what robots of the type share, how each differs, what changed when.

    It equals what `dynid fleet` writes (`to_json`). Units are those of the parameters; dates are UTC.
    """

    def __init__(self, native: _native.Fleet) -> None:
        self._native = native
        self.record: dict[str, Any] = json.loads(native.to_json())
        """The result as dictionaries and lists; its keys are those of `fleet.json`."""

    def to_json(self) -> str:
        """The result file's text."""
        return self._native.to_json()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `fleet.json`; the file appears whole or not at all."""
        _write(path, self.to_json())

    @property
    def status(self) -> str:
        """`ok`, or `warn` where the numbers are to be read with `warnings`. Robots that change are no reservation."""
        return str(self.record["status"])

    @property
    def headline(self) -> str:
        """What it comes down to, in a sentence."""
        return str(self.record["headline"])

    @property
    def warnings(self) -> list[str]:
        """What the numbers are to be read with."""
        return list(self.record["warnings"])

    @property
    def parameters(self) -> Table:
        """Parameters of the type: value, standard deviation, 95 % interval (`low`, `high`), and how robots and logs differ in it."""
        rows = [_with_interval(p) for p in self.record["parameters"]]
        return Table.of_rows(rows, ("name", "unit", "value", "sd", "low", "high", "seen", "between_robots", "between_logs"))

    @property
    def robots(self) -> Table:
        """Robots: `state` (`usual`, `stands_out`, `changed`, `site_event`), number of logs, probability of the largest evidence of a change without
        one, and by how many standard deviations the robot moves the type. `robot(name)` tells all of one."""
        return Table.of_rows(self.record["robots"], ("name", "state", "logs", "p", "influence"))

    def robot(self, name: str) -> dict[str, Any]:
        """All that is known of a robot: its parameters, where it stands out, what changed. Raises `KeyError` if there is none of the name."""
        for robot in self.record["robots"]:
            if robot["name"] == name:
                return dict(robot)
        raise KeyError(name)

    @property
    def changes(self) -> Table:
        """Changes with time: size at the last log, when (`at_s`, `from_s`, `to_s`: s since 1970), and what it points to."""
        rows = [
            {"robot": robot["name"], **change, **change["date"], "when": change["date"]["text"]}
            for robot in self.record["robots"]
            for change in robot["changes"]
        ]
        names = ("robot", "parameter", "kind", "size", "sd", "evidence", "p", "at_s", "from_s", "to_s", "when", "hint")
        return Table.of_rows(rows, names)

    @property
    def outliers(self) -> Table:
        """Robots out of the spread of the fleet: deviation from the type over that spread, and the probability of that in a robot like the others."""
        rows = [{"robot": robot["name"], **outlier} for robot in self.record["robots"] for outlier in robot["stands_out"]]
        return Table.of_rows(rows, ("robot", "parameter", "deviation", "p"))

    @property
    def logs_to_look_at(self) -> Table:
        """Logs that stand out from those of their robot, a row per parameter: deviation over the scatter between logs, and the probability of that
        in a log like the others."""
        rows = [{"log": log["log"], "robot": log["robot"], **p} for log in self.record["logs_to_look_at"] for p in log["parameters"]]
        return Table.of_rows(rows, ("log", "robot", "parameter", "deviation", "p"))

    @property
    def payload(self) -> Table:
        """What every log carried, beyond the mean of all, a row per log and parameter of the link that carries it (its mass first, `link6.m`, then first moments):
        `difference` and its standard deviation. Without rows where the recipe was not learned for that (`payload=`, `--payload`)."""
        carried = self.record.get("payload") or {"parameters": [], "logs": []}
        names = [parameter["name"] for parameter in carried["parameters"]]
        rows = [
            {"log": log["log"], "robot": log["robot"], "parameter": name, "difference": difference, "sd": sd}
            for log in carried["logs"]
            for name, difference, sd in zip(names, log["difference"], log["sd"], strict=True)
        ]
        return Table.of_rows(rows, ("log", "robot", "parameter", "difference", "sd"))

    @property
    def failures(self) -> Table:
        """Logs that could not be reduced or read, and why."""
        return _failures(self.record["failures"])

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._native.report())

    def robot_page(self, name: str, path: str | os.PathLike[str] | None = None) -> str:
        """The page of a robot as HTML, written to `path` if that is given. Raises `KeyError` if there is none of the name."""
        return written(path, self._native.robot_page(name))

    def estimate(self, robot: str | None = None) -> Estimate:
        """The model that robots of the type share, or that of one robot: bodies that can exist, intervals and verdicts, ready to be exported.

        A robot has the bodies of its type, and what its own logs and the fleet say of the rest; one that has changed is what it is at its last
        log. It equals `type.json`, or the JSON of the robot, that `dynid fleet` writes. Raises `KeyError` if there is no robot of the name.
        """
        return Estimate(self._native.estimate(robot))

    def __repr__(self) -> str:
        return f"<dynid.Fleet of {self.record['robot_type']}: {self.status}>\n{self.headline}"

    def _repr_html_(self) -> str:
        parts = [f"<p><b>{html.escape(self.status)}</b>: {html.escape(self.headline)}</p>"]
        parts += [f"<p>{html.escape(warning)}</p>" for warning in self.warnings]
        shown = {"Changes": self.changes, "Out of the spread": self.outliers, "Logs to look at": self.logs_to_look_at, "Failed": self.failures}
        parts += [f"<p>{title}</p>{table._repr_html_()}" for title, table in shown.items() if table.height]
        return "".join(parts)


def fleet(
    folders: str | os.PathLike[str] | FactorStore | Sequence[str | os.PathLike[str] | FactorStore],
    *,
    between_robots: Sequence[str] | None = None,
    between_logs: Sequence[str] | None = None,
    covariates: Sequence[str] | None = None,
    false_discoveries: float = 0.05,
    progress: Progress = None,
    threads: int = 0,
) -> Fleet:
    """Fits the fleet whose factors lie in folders, as `dynid fleet` does.

    The same set of logs gives the same bits: whoever reduced them, in whatever order, into however many folders, whatever `threads` (0: all cores).

    Parameters
    ----------
    folders
        Folders of factors by one recipe, or `FactorStore`.
    between_robots
        Parameters in which robots differ, by symbol (`fc`) or name (`j2.fc`). Default: all of joints but the inertia of rotors.
    between_logs
        Parameters in which logs of one robot differ. Default: those of `between_robots`.
    covariates
        Numbers of the logs that parameters follow. Default: all that every log states and that vary.
    false_discoveries
        Share of the robots that are named for a change that may have none; of robots and logs that are named as outliers alike.

    Raises `DynidError` for folders that cannot be read, of several recipes, of one robot alone, and for settings that nothing fits.
    """
    several = [folders] if isinstance(folders, (str, os.PathLike, FactorStore)) else folders
    paths = [str(f.folder) if isinstance(f, FactorStore) else os.fspath(f) for f in several]
    settings = {
        "between_robots": _names(between_robots),
        "between_logs": _names(between_logs),
        "covariates": _names(covariates),
        "false_discoveries": false_discoveries,
    }
    return Fleet(_native.fleet(paths, as_json(settings), progress=teller(progress), threads=threads))


def _names(names: Sequence[str] | None) -> list[str] | None:
    if isinstance(names, str):
        raise TypeError("expected a list of names, found a text")
    return None if names is None else list(names)


def _failures(failures: Sequence[Mapping[str, Any]]) -> Table:
    return Table.of_rows(failures, ("log", "robot", "code", "message", "hint"))


def _with_interval(row: Mapping[str, Any]) -> dict[str, Any]:
    low, high = row["interval"]
    return {**row, "low": low, "high": high}


def _recipe(recipe: Recipe) -> bytes:
    if isinstance(recipe, Factor):
        return recipe.to_bytes()
    return recipe if isinstance(recipe, bytes) else Path(recipe).read_bytes()


@lru_cache(maxsize=4)
def _reducer(recipe: bytes) -> _native.LogReducer:
    """What reduces logs: made once per process and recipe."""
    return _native.LogReducer(recipe)


def _row(row: Mapping[str, Any]) -> ManifestRow:
    """A row as what is compiled takes it."""
    unknown = set(row) - set(ManifestRow.__annotations__)
    if unknown:
        raise ValueError(f"row: expected log, path, robot, start and covariates, found {', '.join(sorted(unknown))}")
    log, robot = (row.get(key) for key in ("log", "robot"))
    for key, value in (("log", log), ("robot", robot)):
        if not isinstance(value, str) or not value:
            raise ValueError(f"{key}: expected a name, found {value!r}")
    covariates = {}
    for name, value in (row.get("covariates") or {}).items():
        if name in ("log", "robot", "start") or name.startswith("#"):
            raise ValueError(f"covariates: expected a name that a manifest can have, found {name!r}")
        if not math.isfinite(value):
            raise ValueError(f"{name}: expected a finite number, found {value}")
        covariates[name] = float(value)
    path = row.get("path")
    start = row.get("start")
    return {
        "log": str(log),
        "path": str(log) if path is None else os.fspath(path),
        "robot": str(robot),
        "start": None if start is None else _seconds(start),
        "covariates": covariates,
    }


def _seconds(start: Start) -> float:
    """Seconds since 1970."""
    if isinstance(start, datetime):
        if start.tzinfo is None:
            raise ValueError(f"start: expected a date with its offset from UTC, found {start.isoformat()}")
        return start.timestamp()
    if isinstance(start, date):
        return datetime(start.year, start.month, start.day, tzinfo=timezone.utc).timestamp()
    found = _native.date(start) if isinstance(start, str) else float(start)
    if found is None or not math.isfinite(found):
        raise ValueError(f"start: expected seconds since 1970 or a date as 2026-03-01T12:00:00Z, found {start!r}")
    return found
