"""Notebooks of the examples: every cell runs, and what they assert holds."""

from __future__ import annotations

import json
from typing import Any

import pytest
from conftest import ROOT

NEEDS = {"mujoco": ["mujoco"], "pinocchio": ["pinocchio"], "trust": []}


def test_all_are_here() -> None:
    assert {p.stem for p in (ROOT / "examples/notebooks").glob("*.ipynb")} == set(NEEDS)


@pytest.mark.parametrize("name", NEEDS)
def test_notebook(name: str) -> None:
    for module in NEEDS[name]:
        pytest.importorskip(module)
    document = json.loads((ROOT / f"examples/notebooks/{name}.ipynb").read_text(encoding="utf-8"))
    names: dict[str, Any] = {}
    for cell in document["cells"]:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "outputs would go stale: clear them"
            exec("".join(cell["source"]), names)  # noqa: S102
