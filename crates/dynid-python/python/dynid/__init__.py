"""Identify the dynamic parameters of robots: arrays in, verdicts out.

>>> import dynid
>>> arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
>>> made = dynid.simulate(arm, duration_s=20, rate_hz=250, seed=1)
>>> found = dynid.identify(arm, made.log)
>>> print(found.headline[:50])
10 of 10 base parameters seen in the data; the mod
>>> found.predict(made.q[:2], made.clean_v[:2], made.clean_a[:2]).shape
(2, 2)

Angles are in rad, lengths in m, efforts in N m or N, times in s. Arrays of states have one row per sample and one column per joint, in the
order of `Robot.joints`; one state may be given without the axis of samples, and comes back so.
"""

from . import examples
from ._commands import Comparison, Design, Gains, NextMotion, Online, check, compare, design, gains, next_motion
from ._estimate import Estimate, Factor, identify, identify_file
from ._friction import Friction, FrictionLog, PreslidingLog, friction
from ._fleet import FactorStore, Fleet, ManifestRow, fleet, read_manifest, reduce_log
from ._descriptions import robot_description
from ._log import Log, Simulation, find_logs, read_columns, simulate
from ._native import (
    DynidError,
    DynidWarning,
    EstimateError,
    LogError,
    Robot,
    RobotError,
    SettingError,
    UnsupportedError,
    __version__,
)
from ._servo import CommandLog, Servo, servo
from ._table import Table

__all__ = [
    "CommandLog",
    "Comparison",
    "Design",
    "DynidError",
    "DynidWarning",
    "Estimate",
    "EstimateError",
    "Factor",
    "FactorStore",
    "Fleet",
    "Friction",
    "FrictionLog",
    "Gains",
    "Log",
    "LogError",
    "ManifestRow",
    "NextMotion",
    "Online",
    "PreslidingLog",
    "Robot",
    "RobotError",
    "Servo",
    "SettingError",
    "Simulation",
    "Table",
    "UnsupportedError",
    "__version__",
    "check",
    "compare",
    "design",
    "examples",
    "find_logs",
    "fleet",
    "friction",
    "gains",
    "identify",
    "identify_file",
    "next_motion",
    "read_columns",
    "read_manifest",
    "reduce_log",
    "robot_description",
    "servo",
    "simulate",
]
