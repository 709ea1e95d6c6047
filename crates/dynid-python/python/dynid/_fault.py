"""Errors with what can be done about them."""

from __future__ import annotations

from typing import TypeVar

from ._native import DynidError

Fault = TypeVar("Fault", bound=DynidError)


def fault(kind: type[Fault], what: str, hint: str) -> Fault:
    """An error as the command line words it, to be raised."""
    error = kind(f"{what}\nhint: {hint}")
    error.hint = hint
    return error
