"""What the tests share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import dynid
import numpy as np
import pytest
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def indy7() -> dynid.Robot:
    return dynid.Robot.load(ROOT / "robots" / "indy7.toml")


@pytest.fixture(scope="session")
def made(indy7: dynid.Robot) -> dynid.Simulation:
    return dynid.simulate(indy7, duration_s=20, rate_hz=200, seed=1)


@pytest.fixture(scope="session")
def unseen(indy7: dynid.Robot) -> dynid.Simulation:
    return dynid.simulate(indy7, duration_s=20, rate_hz=200, seed=2)


@pytest.fixture(scope="session")
def found(indy7: dynid.Robot, made: dynid.Simulation, unseen: dynid.Simulation) -> dynid.Estimate:
    return dynid.identify(indy7, made.log, validation=unseen.log)


States = Callable[[int, int], tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]


@pytest.fixture
def states() -> States:
    """Random states of a robot with single-axis joints: `(nv, count)` to `q, v, a`."""

    def of(nv: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        rng = np.random.default_rng(7)
        return rng.uniform(-3, 3, (count, nv)), rng.uniform(-2, 2, (count, nv)), rng.uniform(-5, 5, (count, nv))

    return of


def shared(name: str) -> Path:
    """A file beside the repository that is not shipped; the test is skipped where it is not there."""
    path = ROOT.parent / "shared" / name
    if not path.exists():
        pytest.skip(f"{name} is not beside the repository")
    return path
