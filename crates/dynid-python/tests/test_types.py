"""Types and examples of the documentation."""

from __future__ import annotations

import doctest

import dynid
import pytest
from conftest import ROOT


def test_types_hold() -> None:
    api = pytest.importorskip("mypy.api")
    text, _, status = api.run([str(ROOT / "crates/dynid-python" / part) for part in ("python/dynid", "tests")] + ["--config-file", str(ROOT / "pyproject.toml"), "--no-incremental"])
    assert status == 0, text


def test_example_of_the_package() -> None:
    assert doctest.testmod(dynid) == (0, 6)
