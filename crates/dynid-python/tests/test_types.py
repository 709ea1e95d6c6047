"""Types and examples of the documentation."""

from __future__ import annotations

import doctest
import re
from pathlib import Path
from typing import Any

import dynid
import pytest
from conftest import ROOT


def test_types_hold() -> None:
    api = pytest.importorskip("mypy.api")
    text, _, status = api.run(
        [str(ROOT / part) for part in ("crates/dynid-python/python/dynid", "crates/dynid-python/tests", "examples/fleet")]
        + ["--config-file", str(ROOT / "pyproject.toml"), "--no-incremental"]
    )
    assert status == 0, text


def test_example_of_the_package() -> None:
    assert doctest.testmod(dynid) == (0, 6)


def test_page_of_the_book(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "robots").symlink_to(ROOT / "robots")
    monkeypatch.chdir(tmp_path)

    def blocks(page: str) -> list[str]:
        return re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)

    names: dict[str, Any] = {}
    assert len(blocks("docs/book/src/python.md")) == 6
    exec("\n".join(blocks("docs/book/src/python.md")), names)  # noqa: S102
    assert {"estimate.json", "report.html", "robot.urdf"} <= {p.name for p in tmp_path.iterdir()}
    record = names["record"]
    (readme,) = blocks("README.md")
    exec(readme, {"model": names["model"], "t": record.t, "q": record.q, "tau": record.tau})  # noqa: S102
