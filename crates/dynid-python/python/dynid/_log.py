"""Logs, measured and virtual."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrow import columns
from ._robot_file import RobotOrPath, as_robot
from ._settings import as_json


class Log:
    """A log of a robot: arrays, or a file that is read once the robot is known.

    Parameters
    ----------
    t
        `(n,)` times, s. The clock need not be uniform.
    q, tau
        `(n, joints)` positions (rad or m) and efforts (N m or N) as the drives give them.
    v
        `(n, joints)` measured velocities, where there are some.
    joints
        Names of the columns. Default: those of `Robot.joints`, in that order. Joints that are left out stand still at zero.
    channels
        Other signals by name, `(n,)` each: `temperature_<joint>` in °C, `journal_<joint>_x` in m.
    name
        Name in parameters and messages.
    settings
        `payload`, `own`, `like`, `temperature`, `period_s`: the keys of `[[log]]` in a configuration.

    Arrays of other types and layouts are converted. What no joint does, angles in degrees for example, is refused with `LogError` when the log
    meets its robot.
    """

    def __init__(
        self,
        t: ArrayLike,
        q: ArrayLike,
        tau: ArrayLike,
        v: ArrayLike | None = None,
        *,
        joints: Sequence[str] | None = None,
        channels: Mapping[str, ArrayLike] | None = None,
        name: str = "log",
        **settings: Any,
    ) -> None:
        names = None if joints is None else list(joints)
        extra = None if channels is None else dict(channels)
        self._native = _native.Log(t, q, tau, v, joints=names, channels=extra, name=name, settings=as_json(settings))

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        columns: Mapping[str, Any] | None = None,
        motor_side: Mapping[str, Any] | None = None,
        **settings: Any,
    ) -> Log:
        """A log file, of any format that the command line reads; `columns`, `motor_side` and `settings` (`rows`, `part`, `leave_out`, ...)
        are those of a configuration. It is read when it meets its robot."""
        log = cls.__new__(cls)
        side = None if motor_side is None else as_json(dict(motor_side))
        log._native = _native.Log.read_file(os.fspath(path), columns=as_json(dict(columns or {})), motor_side=side, settings=as_json(settings))
        return log

    @classmethod
    def from_table(cls, table: Any, **settings: Any) -> Log:
        """A log of named columns: a dictionary of arrays, a pandas, polars or pyarrow table, or whatever offers `__arrow_c_stream__`
        (DuckDB, arro3, nanoarrow and others), which needs no library beside.

        Columns are `t`, `q_<joint>`, `tau_<joint>`, and `dq_<joint>` where velocities were measured; others, `temperature_<joint>` for
        example, become channels."""
        by_name = isinstance(table, Mapping) or hasattr(table, "column_names") or hasattr(table, "columns")
        if hasattr(table, "__arrow_c_stream__") and not (by_name and hasattr(table, "__getitem__")):
            table = columns(table)
        names = [str(name) for name in getattr(table, "column_names", None) or (table if isinstance(table, Mapping) else table.columns)]

        def column(name: str) -> NDArray[np.float64]:
            values = table[name]
            return np.asarray(values.to_numpy() if hasattr(values, "to_numpy") else values, dtype=np.float64)

        joints = [name[2:] for name in names if name.startswith("q_")]
        missing = [name for name in ["t", *(f"tau_{joint}" for joint in joints)] if name not in names]
        if missing or not joints:
            raise ValueError(f"columns: expected t, q_<joint> and tau_<joint>, missing {missing or 'q_<joint>'} in {names}")

        def stack(prefix: str) -> NDArray[np.float64]:
            return np.stack([column(f"{prefix}_{joint}") for joint in joints], axis=1)

        fast = all(f"dq_{joint}" in names for joint in joints)
        used = {"t"} | {f"{prefix}_{joint}" for prefix in ("q", "tau", *(["dq"] if fast else [])) for joint in joints}
        channels = {name: column(name) for name in names if name not in used}
        velocity = stack("dq") if fast else None
        return cls(column("t"), stack("q"), stack("tau"), velocity, joints=joints, channels=channels, **settings)

    def __repr__(self) -> str:
        return repr(self._native)


def find_logs(path: str | os.PathLike[str]) -> list[str]:
    """The logs that a path stands for, always in the same order.

    A pattern (`runs/*.csv`, `**`), a folder that is no bag, a list (`good.manifest`: a path per line), `demos.hdf5#*` for groups and episodes. A
    log is itself. Each may be given to `Log.read`.

    Raises `LogError` if there is none.
    """
    return [str(log) for log in _native.find_logs(os.fspath(path))]


LogOrPath = Log | str | os.PathLike[str]
"""A log, or the path of one that `Log.read` reads as it is."""


def as_log(given: object) -> Log:
    """A log that was given as such or by its path; anything else is a `TypeError` that says how a log is made of it."""
    if isinstance(given, Log):
        return given
    if isinstance(given, (str, os.PathLike)):
        return Log.read(given)
    raise TypeError(
        f"logs: expected a `dynid.Log` or the path of one, found {type(given).__name__}; "
        "a log of arrays is `dynid.Log(t, q, tau)`, of a table `dynid.Log.from_table(table)`"
    )


def as_list(given: object) -> list[Any]:
    """What was given, one log or several; a table is one thing, though its columns can be gone through."""
    table = isinstance(given, Mapping) or any(hasattr(given, of_table) for of_table in ("columns", "dtype", "__arrow_c_stream__"))
    if isinstance(given, Iterable) and not table and not isinstance(given, (str, os.PathLike)):
        return list(given)
    return [given]


def read_columns(
    path: str | os.PathLike[str],
    robot: RobotOrPath | None = None,
    *,
    columns: Mapping[str, Any] | None = None,
    rows: tuple[int, int] | None = None,
) -> dict[str, NDArray[Any]]:
    """The columns of a log by name, `(n,)` each: a CSV, a bag, a Parquet, HDF5, MATLAB or NumPy file.

    Without a robot all columns that hold numbers, as they are; whole stamps stay whole (`int64`), NaN stands where there is no value. With a
    robot the signals of its joints in SI: `t`, `q_<joint>`, `dq_<joint>`, `tau_<joint>`. `path` may end in `#MEMBER` (an episode, a group, topics);
    `columns` are those of a configuration; `rows` the first and the last row, from 1.

    Raises `LogError` for a file that cannot be read.
    """
    return _native.read_columns(os.fspath(path), None if robot is None else as_robot(robot), columns=as_json(dict(columns or {})), rows=rows)


class Simulation:
    """A virtual log with its truth.

    `t` `(n,)`, `q`, `tau` `(n, joints)` as logged; `clean_q`, `clean_v`, `clean_a`, `clean_tau` without noise; `truth`: parameters by name;
    `log`: a `Log` for `identify`.
    """

    def __init__(self, made: Mapping[str, Any]) -> None:
        self.joints: list[str] = made["joints"]
        self.t: NDArray[np.float64] = made["t"]
        self.q: NDArray[np.float64] = made["q"]
        self.v: NDArray[np.float64] | None = made["v"]
        self.tau: NDArray[np.float64] = made["tau"]
        self.clean_q: NDArray[np.float64] = made["clean_q"]
        self.clean_v: NDArray[np.float64] = made["clean_v"]
        self.clean_a: NDArray[np.float64] = made["clean_a"]
        self.clean_tau: NDArray[np.float64] = made["clean_tau"]
        self.channels: dict[str, NDArray[np.float64]] = made["channels"]
        self.truth: dict[str, float] = made["truth"]
        self.warnings: list[str] = made["warnings"]

    @property
    def log(self) -> Log:
        """What was logged."""
        return Log(self.t, self.q, self.tau, self.v, joints=self.joints, channels=self.channels, name="virtual")


def simulate(robot: RobotOrPath, **settings: Any) -> Simulation:
    """Makes a virtual log; `settings` are the keys of `dynid simulate --config`: `duration_s`, `rate_hz`, `seed`, `effort_noise`,
    `encoder_bits`, `mode="closed_loop"`, ...

    Raises `SettingError` for a setting that is unknown or out of range.
    """
    return Simulation(_native.simulate(as_robot(robot), as_json(settings)))
