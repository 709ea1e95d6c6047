"""Settings on their way to what is compiled."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np


def as_json(settings: Any) -> str:
    """Settings as JSON; NumPy's numbers and arrays, and paths, are what they stand for."""

    def plain(value: Any) -> Any:
        if isinstance(value, (np.generic, np.ndarray)):
            return value.tolist()
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        raise TypeError(f"settings: expected numbers, texts, lists and dictionaries, found {type(value).__name__}")

    return json.dumps(settings, default=plain)
