"""Identification and its result."""

from __future__ import annotations

import html
import json
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _models, _native
from ._log import LogOrPath, as_list, as_log
from ._robot_file import RobotOrPath, as_robot
from ._settings import as_json
from ._table import Table

Progress = bool | Callable[[str], object] | None
"""What is told of long work: a function of a sentence, or True for a line on stderr."""

_PARAMETERS = ("name", "unit", "value", "std", "low", "high", "verdict", "combination", "advice", "link", "joint", "prior", "unconstrained")
_BASE = ("name", "expression", "unit", "value", "std", "half_width", "verdict", "consistent_value")


def native_logs(logs: LogOrPath | Iterable[LogOrPath]) -> list[_native.Log]:
    """One log or several, as what is compiled knows them."""
    return [as_log(log)._native for log in as_list(logs)]


def teller(progress: Progress) -> Callable[[str], object] | None:
    """The function that is told of progress."""
    if progress is True:

        def line(step: str) -> None:
            sys.stderr.write(f"\r\x1b[K{step}")
            sys.stderr.flush()

        return line
    return progress or None


class Estimate:
    """What an identification found: parameters with intervals and verdicts, and the model that they make.

    It pickles, and equals what the command line writes (`to_json`).
    """

    def __init__(self, native: _native.Estimate) -> None:
        self._native = native
        self._record: dict[str, Any] | None = None

    @classmethod
    def load(cls, path: str | os.PathLike[str], robot: RobotOrPath | None = None) -> Estimate:
        """An `estimate.json`. `robot`: where the robot was made of a text or another library's model, for exports and `validate`."""
        return cls(_native.Estimate.parse(Path(path).read_bytes(), None if robot is None else as_robot(robot)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `estimate.json`; the file appears whole or not at all."""
        _write(path, self.to_json())

    def to_json(self) -> str:
        """The result file's text."""
        return self._native.to_json()

    @property
    def record(self) -> dict[str, Any]:
        """The result file as dictionaries and lists; its keys are those of `estimate.json`."""
        record = self._record
        if record is None:
            record = self._record = dict(json.loads(self.to_json()))
        return record

    @property
    def status(self) -> str:
        """`ok`, `warn` or `fail`."""
        return self._native.status

    @property
    def headline(self) -> str:
        """What it comes down to, in a sentence."""
        return self._native.headline

    @property
    def joints(self) -> list[str]:
        """Joints, then motors behind springs: the order of columns."""
        return self._native.joints

    @property
    def checks(self) -> Table:
        """Checks with their verdicts."""
        return Table.of_rows(self.record["verdict"]["checks"], ("status", "name", "value", "unit", "limit", "meaning"))

    @property
    def parameters(self) -> Table:
        """Standard parameters: value, standard deviation, 95 % interval (`low`, `high`), and where the value comes from."""
        rows = [dict(p, low=(p.get("interval") or [None, None])[0], high=(p.get("interval") or [None, None])[1]) for p in self.record["parameters"]]
        return Table.of_rows(rows, _PARAMETERS)

    @property
    def base_parameters(self) -> Table:
        """What motion can tell: combinations of standard parameters with their values."""
        return Table.of_rows(self.record["base_parameters"], _BASE)

    @property
    def shape_parameters(self) -> Table:
        """Parameters that enter efforts nonlinearly, a Stribeck speed for example."""
        return Table.of_rows(self.record["shape_parameters"], ("name", "unit", "value", "std"))

    @property
    def payloads(self) -> list[dict[str, Any]]:
        """What was found of bodies that some logs carry (`payload=[{"name": ...}]`, `Log(..., payload=...)`): mass, centre of mass and inertia, each
        with interval and verdict, and `sentence`. Those that the settings know altogether are none of it."""
        records: list[dict[str, Any]] = json.loads(self._native.payloads())
        return records

    def value(self, name: str) -> float:
        """The value of a standard parameter, as `link.m` or `joint.fc`."""
        for p in self.record["parameters"]:
            if p["name"] == name:
                return float(p["value"])
        raise KeyError(name)

    @property
    def covariance(self) -> tuple[list[str], NDArray[np.float64]]:
        """Names and covariance matrix of the base parameters that were solved for."""
        return self._native.covariance()

    def predict(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        *,
        channels: Mapping[str, ArrayLike] | None = None,
        unconstrained: bool = False,
        threads: int = 1,
    ) -> NDArray[np.float64]:
        """Efforts, `(n, joints)`: rigid bodies and all elements at joints.

        `q` `(n, nq)`, `v` and `a` `(n, nv)`, or one state without the axis of samples. `channels`: what the model reads beside them, by name.
        `unconstrained`: by the parameters before bodies had to be such that can exist. `threads`: 0 for all cores.
        """
        extra = None if channels is None else dict(channels)
        return self._native.predict(q, v, a, channels=extra, unconstrained=unconstrained, threads=threads)

    def feedforward(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> NDArray[np.float64]:
        """Efforts of one state, for a controller: `predict` by another name."""
        return self._native.predict(q, v, a)

    def validate(self, logs: LogOrPath | Iterable[LogOrPath], *, unconstrained: bool = False, filter_hz: float | None = None) -> list[dict[str, Any]]:
        """Predicted against measured efforts of other logs: per log the figures of `validation` in `estimate.json`."""
        text = self._native.validate(native_logs(logs), unconstrained=unconstrained, filter_hz=filter_hz)
        fits: list[dict[str, Any]] = json.loads(text)
        return fits

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._native.report())

    def to_urdf(self, path: str | os.PathLike[str] | None = None, *, allow_unphysical: bool = False) -> str:
        """URDF with identified inertias and friction. What it has no place for is told by a `DynidWarning`.

        Loops of a mechanism are written beside `path`, as `<name>.loops.toml`; without a path see `to_loops`.
        """
        name = "robot.urdf" if path is None else Path(path).name
        text, loops, _ = self._native.exported("urdf", name, allow_unphysical)
        if path is not None and loops is not None:
            written(Path(path).with_suffix(".loops.toml"), loops)
        return written(path, text)

    def to_loops(self, urdf: str = "robot.urdf") -> str | None:
        """What closes the loops of a URDF of that name: a robot file that refers to it; None for a robot without loops."""
        with warnings.catch_warnings():
            # Told where the URDF itself is made.
            warnings.simplefilter("ignore", _native.DynidWarning)
            return self._native.exported("urdf", urdf, True)[1]

    def to_mjcf(self, path: str | os.PathLike[str] | None = None, *, allow_unphysical: bool = False) -> str:
        """MJCF with identified inertias, friction and armature. What it has no place for is told by a `DynidWarning`.

        The MJCF of a robot from MJCF is edited in place. Included files that change are written beside `path`, under the names by which they
        are included.
        """
        text, _, included = self._native.exported("mjcf", "", allow_unphysical)
        if included and path is None:
            raise ValueError(f"to_mjcf: {', '.join(name for name, _ in included)}, which the robot includes, changes as well: give a path")
        if path is not None:
            for name, other in included:
                target = Path(path).parent / name
                target.parent.mkdir(parents=True, exist_ok=True)
                written(target, other)
        return written(path, text)

    def to_model_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """The whole identified model, elements of every law included, as JSON."""
        return written(path, self._native.exported("model", "", True)[0])

    def apply(self, model: Any) -> list[str]:
        """Puts identified inertias, friction and armature into a `mujoco.MjModel` or a `pinocchio.Model`, in place.

        Gives a sentence for each thing that the model has no place for. Robots must have come from a model of the same structure
        (`Robot.from_mujoco`, `Robot.from_pinocchio`)."""
        return _models.apply(self.record, model)

    def reduce(self, logs: LogOrPath | Iterable[LogOrPath], *, delays: bool = False, payload: str | None = None) -> Factor:
        """Reduces logs by the choices of this identification to a `Factor`.

        `delays`: with a column per effort for the rest of its delay, log by log, so that a fleet sees how delays differ and change.
        `payload`: link on which every log may carry something else; the identification has to have kept the parameters of the link as columns,
        `preferred=[f"{link}.{symbol}" ...]` with the symbols m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz.
        """
        return Factor(_native.Factor.of(self._native, native_logs(logs), delays, payload))

    def __repr__(self) -> str:
        return f"{self._native!r}\n{self.headline}"

    def _repr_html_(self) -> str:
        seen = [p for p in self.parameters.rows() if p["verdict"] == "seen in the data"]
        names = ("name", "value", "std", "low", "high", "unit", "verdict")
        hidden = self.parameters.height - len(seen)
        more = f"<p>{hidden} more are carried by the prior or act only in combinations: <code>.parameters</code>, <code>.base_parameters</code>.</p>"
        checks = "".join(
            f"<li>[{html.escape(str(c['status']))}] {html.escape(str(c['name']))}: {html.escape(str(c['meaning']))}</li>"
            for c in self.checks.rows()
            if c["status"] != "ok"
        )
        title = f"<p><b>{html.escape(self.status)}</b>: {html.escape(self.headline)}</p>"
        return title + Table.of_rows(seen, names)._repr_html_() + (more if hidden else "") + f"<ul>{checks}</ul>"

    def __reduce__(self) -> tuple[type[Estimate], tuple[_native.Estimate]]:
        return (Estimate, (self._native,))


class Factor:
    """Logs reduced to triangular factors: a few kilobytes that travel, merge in any order and are solved to the estimate of all their logs.

    `Estimate.reduce` makes the first; `factor.reduce(logs)` reduces others alike, on another machine for example.
    """

    def __init__(self, native: _native.Factor) -> None:
        self._native = native

    @classmethod
    def from_bytes(cls, data: bytes) -> Factor:
        """A factor file's bytes."""
        return cls(_native.Factor.from_bytes(data))

    def to_bytes(self) -> bytes:
        """A factor file, as `dynid reduce` writes it."""
        return self._native.to_bytes()

    @classmethod
    def merge(cls, parts: Sequence[Factor]) -> Factor:
        """Factors of disjoint logs together; their order does not matter, to the bit."""
        return cls(_native.Factor.merge([part._native for part in parts]))

    def __add__(self, other: Factor) -> Factor:
        return Factor.merge([self, other])

    def reduce(self, logs: LogOrPath | Iterable[LogOrPath]) -> Factor:
        """Reduces other logs by the recipe inside."""
        return Factor(self._native.reduce(native_logs(logs)))

    def solve(self, validation: LogOrPath | Iterable[LogOrPath] = (), *, progress: Progress = None, threads: int = 0) -> Estimate:
        """The estimate of all logs inside."""
        return Estimate(self._native.solve(native_logs(validation), progress=teller(progress), threads=threads))

    @property
    def logs(self) -> list[str]:
        """Names of the logs inside."""
        return self._native.logs

    def __repr__(self) -> str:
        return repr(self._native)

    def __reduce__(self) -> tuple[type[Factor], tuple[_native.Factor]]:
        return (Factor, (self._native,))


def identify(
    robot: RobotOrPath,
    logs: LogOrPath | Iterable[LogOrPath],
    *,
    validation: LogOrPath | Iterable[LogOrPath] = (),
    progress: Progress = None,
    threads: int = 0,
    **settings: Any,
) -> Estimate:
    """Identifies a robot from logs: examines them, conditions, fits, judges, validates.

    `robot`, `logs`: values, or paths of files that need no more to be said of them (`Robot.load` and `Log.read` say it).
    `settings` are the tables of a configuration: `elements={"friction": "stribeck"}`, `estimator={"method": "iv"}`,
    `tie=[["j1", "j2"]]`, `payload=[{"name": "tool"}]`, ... A setting that is unknown or without effect raises `SettingError`.
    The same robot, logs and settings give the bits of `dynid identify`, whatever `threads` (0: all cores).

    An interrupt ends the wait at once and leaves nothing behind.
    """
    text = as_json(settings)
    found = _native.identify(as_robot(robot), native_logs(logs), native_logs(validation), text, progress=teller(progress), threads=threads)
    return Estimate(found)


def identify_file(path: str | os.PathLike[str], *, progress: Progress = None, threads: int = 0) -> Estimate:
    """Does what a configuration file says, as `dynid identify` does, and writes nothing."""
    return Estimate(_native.identify_file(os.fspath(path), progress=teller(progress), threads=threads))


def written(path: str | os.PathLike[str] | None, text: str) -> str:
    """A text, written to a file if one is named."""
    if path is not None:
        _write(path, text)
    return text


def _write(path: str | os.PathLike[str], text: str) -> None:
    target = Path(path)
    beside = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)
