"""Before and beside identification: pre-flight, comparisons, drive gains, designs, robots that run."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._estimate import Factor, Progress, native_logs, teller, written
from ._log import LogOrPath
from ._servo import Servo
from ._robot_file import RobotOrPath, as_robot, robot_keys
from ._settings import as_json
from ._table import Table


def check(robot: RobotOrPath, logs: LogOrPath | Iterable[LogOrPath], **settings: Any) -> Table:
    """What is wrong with logs before anything is identified: a row per finding, none for logs that nothing speaks against.

    Columns: `severity` (`error`: an identification would be nonsense), `id` (`dynid explain ID` says more), `log`, `joint`, `evidence`, `remedy`.
    What no joint does, angles in degrees for example, raises `LogError`, as in `identify`.
    """
    rows: list[dict[str, Any]] = json.loads(_native.check(as_robot(robot), native_logs(logs), as_json(settings)))
    return Table.of_rows(rows, ("severity", "id", "log", "joint", "evidence", "remedy"))


class Comparison:
    """Every estimator that applies, by its error on time that it did not see.

    `record`: the keys of `dynid compare --json`.
    """

    def __init__(self, text: str, page: str) -> None:
        self.record: dict[str, Any] = json.loads(text)
        self._report = page

    @property
    def estimators(self) -> Table:
        """A row per estimator, best first, failed ones last.

        Columns: `name`, `what`, `rank`, `error` (held-out error relative to the effort, mean over joints, %), `standard_error`,
        `level_with_best` (behind by less than two standard errors), `seconds` (of a fit), `failure`.
        """
        names = ("name", "what", "rank", "error", "standard_error", "level_with_best", "seconds", "failure")
        return Table.of_rows(self.record["estimators"], names)

    @property
    def joints(self) -> Table:
        """A row per estimator that was fitted and joint that moves: `estimator`, `joint`, `rms` (N m or N), `relative` (%)."""
        rows = [
            {"estimator": one["name"], "joint": joint, **errors}
            for one in self.record["estimators"]
            for joint, errors in zip(self.record["joints"], one["joints"], strict=False)
            if errors is not None
        ]
        return Table.of_rows(rows, ("estimator", "joint", "rms", "relative"))

    @property
    def best(self) -> str | None:
        """Name of the best estimator; None if none could be fitted."""
        first = self.record["estimators"][0]
        return None if first["rank"] is None else str(first["name"])

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._report)

    def __repr__(self) -> str:
        return f"<dynid.Comparison>\n{self.estimators!r}"


def compare(robot: RobotOrPath, logs: LogOrPath | Iterable[LogOrPath], *, progress: Progress = None, threads: int = 0, **settings: Any) -> Comparison:
    """Compares estimators on the same logs: each is fitted to all folds of time but one, and predicts that one.

    `settings` as for `identify`, but that every estimator takes its own method; kernel, masks and delay are chosen once for all estimators. One that fails is in the table, with the reason.
    """
    text, page = _native.compare(as_robot(robot), native_logs(logs), as_json(settings), progress=teller(progress), threads=threads)
    return Comparison(text, page)


class Gains:
    """Gains of drives, effort per unit of what was logged, by a payload of known mass.

    `record`: the keys of `dynid gains --json`.
    """

    def __init__(self, text: str) -> None:
        self.record: dict[str, Any] = json.loads(text)

    @property
    def status(self) -> str:
        """`ok` if the gain of a drive at least is determined, else `fail`."""
        return str(self.record["status"])

    @property
    def warnings(self) -> list[str]:
        """What to mind."""
        return list(self.record["warnings"])

    @property
    def joints(self) -> Table:
        """A row per drive: `joint`, `gain` (None unless it is determined), `std`, `low` and `high` (95 %), `unit`, `t` (of the load's effort),
        `share` (of the load's effort that nothing else explains), `verdict`."""
        rows = [{**row, **dict(zip(("low", "high"), row["interval"] or (), strict=False))} for row in self.record["joints"]]
        return Table.of_rows(rows, ("joint", "gain", "std", "low", "high", "unit", "t", "share", "verdict"))

    def __repr__(self) -> str:
        return f"<dynid.Gains by {self.record['payload']} of {self.record['mass']} kg>\n{self.joints!r}"


def gains(robot: RobotOrPath, logs: LogOrPath | Iterable[LogOrPath], *, progress: Progress = None, threads: int = 0, **settings: Any) -> Gains:
    """Finds what a unit of logged effort (a current in A, say) is in N m or N, from logs with and without a payload of known mass.

    `logs`: `Log(..., payload="tool")` for those that carry it. `settings`: `payload=[{"name": "tool", "mass": 2.0, "com": [0, 0, 0.1]}]`, and
    those of `identify` that gains depend on; others are refused. No pre-flight is made (`check` makes it). A drive on which the load does not act is an outcome (`verdict`), not an error.
    """
    return Gains(_native.gains(as_robot(robot), native_logs(logs), as_json(settings), progress=teller(progress), threads=threads))


class Design:
    """A motion that tells the parameters apart, with what a log of it will tell.

    `feasible`; if so `t` `(n,)`, `q`, `v`, `a` `(n, joints)` of approach, periods and return, for `joints`. `record`: the keys of
    `design.json`, with `parameters` (forecast of standard deviations) and `limits`. `commands` `(n, joints)`: what drives are told, in the numbers of
    their encoders, of designs with `drives`.
    """

    def __init__(self, made: Mapping[str, Any]) -> None:
        self.record: dict[str, Any] = json.loads(made["record"])
        self._report: str = made["report"]
        self.feasible: bool = "t" in made
        empty = np.zeros((0, 0))
        self.joints: list[str] = made.get("joints", [])
        self.t: NDArray[np.float64] = made.get("t", np.zeros(0))
        self.q: NDArray[np.float64] = made.get("q", empty)
        self.v: NDArray[np.float64] = made.get("v", empty)
        self.a: NDArray[np.float64] = made.get("a", empty)
        self.commands: NDArray[np.float64] | None = made.get("commands")

    @property
    def headline(self) -> str:
        """What it comes down to, in a sentence."""
        return str(self.record["verdict"]["headline"])

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """The report as one HTML page, written to `path` if that is given."""
        return written(path, self._report)

    def __repr__(self) -> str:
        return f"<dynid.Design of {', '.join(self.joints) or 'nothing'}>\n{self.headline}"


def design(robot: RobotOrPath, *, progress: Progress = None, threads: int = 0, **settings: Any) -> Design:
    """Designs an excitation trajectory within the limits of robot and surroundings.

    `settings` are the tables of a design file: `trajectory={"period_s": 10, "harmonics": 5}`, `limits={"share": 0.8}`, `keep=[...]`,
    `search={"starts": 8}`, ... No motion within all limits is an outcome (`feasible`), not an error. `drives`: what `servo` found (or its `servo.json`),
    for a log of commands and positions without efforts.
    """
    with tempfile.TemporaryDirectory() as folder:
        drives = settings.get("drives")
        if isinstance(drives, Servo):
            path = Path(folder) / "servo.json"
            path.write_text(drives.to_json(), encoding="utf-8")
            settings = {**settings, "drives": str(path)}
        with robot_keys(as_robot(robot), settings) as config:
            return Design(_native.design(config, progress=teller(progress), threads=threads))


class NextMotion(Design):
    """The shortest motion that narrows intervals to what is wanted, with what is expected of it.

    As `Design`; without a motion (`feasible` is False) nothing has to be recorded, or no motion would help. `record`: the keys of `next.json`.
    """

    @property
    def status(self) -> str:
        """`pass`, `warn` or `fail`."""
        return str(self.record["verdict"]["status"])

    @property
    def wanted(self) -> Table:
        """A row per parameter of which an interval is wanted.

        Columns: `name`, `unit`, `value`, `half_width` (95 %, today; None if it is not seen), `wanted_half_width`, `half_width_after` (expected), `state` (what comes of it),
        `combination` (what data see of a parameter that acts only together with others)."""
        names = ("name", "unit", "value", "half_width", "wanted_half_width", "half_width_after", "state", "combination")
        return Table.of_rows(self.record["wanted"], names)

    def __repr__(self) -> str:
        return f"<dynid.NextMotion: {self.status}>\n{self.headline}"


def next_motion(
    robot: RobotOrPath,
    after: Factor | Iterable[Factor],
    want: Mapping[str, float | str],
    *,
    longest_s: float | None = None,
    progress: Progress = None,
    threads: int = 0,
    **settings: Any,
) -> NextMotion:
    """Designs what to record next, as `dynid next` does: the shortest motion within the limits that brings the intervals that are wanted.

    `after`: factors of all logs so far (`Estimate.reduce`, merged or not). `want`: half widths of 95 % intervals by name, in the parameter's unit or as a share (`{"j1.fc": 0.05,
    "link2.*": "10%"}`; `*` stands for any text). `longest_s`: longest record, 120 s unless stated. `settings`: the tables of a design file that hold here: `limits`, `trajectory`, `search`, `keep`, ...

    That no motion brings what is wanted is an outcome (`wanted`), not an error. Raises `SettingError` for names that are no parameters.
    """
    factors = [after] if isinstance(after, Factor) else list(after)
    wanted = [f"{name}={width}" for name, width in want.items()]
    with robot_keys(as_robot(robot), settings) as config:
        natives = [factor._native for factor in factors]
        return NextMotion(_native.next_motion(config, natives, wanted, longest_s, progress=teller(progress), threads=threads))


class Online:
    """Identification of a robot while it runs: feed rows, read events.

    Parameters
    ----------
    joints
        Names of the columns of `q`. Default: `Robot.joints`.
    velocity
        Whether `feed` takes measured velocities.
    settings
        `online={"learn_s": 10, ...}` and the other tables of a configuration.

    An event is a dictionary whose `event` names it: `learning`, `learned`, `estimate`, `alarm`, `change` and others, as `dynid online` prints
    them. The first stretch is learned from; estimates come from then on.
    """

    def __init__(self, robot: RobotOrPath, *, joints: Sequence[str] | None = None, velocity: bool = False, **settings: Any) -> None:
        robot = as_robot(robot)
        self._names = list(robot.joints if joints is None else joints)
        self._velocity = velocity
        prefixes = ["q", *(["dq"] if velocity else []), "tau"]
        header = ["t", *(f"{prefix}_{joint}" for prefix in prefixes for joint in self._names)]
        with robot_keys(as_robot(robot), settings) as config:
            self._native = _native.Online(config, header)

    @property
    def joints(self) -> list[str]:
        """Joints in the order of all figures of events."""
        return self._native.joints

    def feed(self, t: ArrayLike, q: ArrayLike, tau: ArrayLike, v: ArrayLike | None = None) -> list[dict[str, Any]]:
        """Takes a row (`t` a number) or a block of rows (`t` `(n,)`, the others `(n, joints)`); gives what came of it."""
        if (v is None) == self._velocity:
            raise TypeError("v: the session was made " + ("with" if self._velocity else "without") + " `velocity`")
        time = np.asarray(t, dtype=np.float64)
        shape = (*time.shape, len(self._names))
        signals = {"q": q, "v": v, "tau": tau}
        parts = [(name, np.asarray(x, dtype=np.float64)) for name, x in signals.items() if x is not None]
        for name, part in parts:
            if time.ndim > 1 or part.shape != shape:
                raise ValueError(f"{name}: expected shape {shape} as t has, found {part.shape}")
        rows = np.concatenate([time[..., None], *(part for _, part in parts)], axis=-1)
        return self._events(self._native.feed(rows))

    def finish(self) -> list[dict[str, Any]]:
        """Ends the stream; gives the last events."""
        return self._events(self._native.finish())

    @staticmethod
    def _events(text: str) -> list[dict[str, Any]]:
        events: list[dict[str, Any]] = json.loads(text)
        return events
