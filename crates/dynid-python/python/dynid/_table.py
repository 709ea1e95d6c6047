"""Tables of results, for whichever library reads them."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any


class Table(Mapping[str, list[Any]]):
    """Named columns of equal length: a mapping from name to list.

    `to_pandas()`, `to_polars()` and `to_arrow()` need those libraries; `rows()` needs none. Libraries that read `__arrow_c_stream__` (DuckDB, polars and
    others) take it as it is where there is pyarrow.
    """

    def __init__(self, columns: Mapping[str, Sequence[Any]]) -> None:
        self._columns = {name: list(values) for name, values in columns.items()}
        if len({len(values) for values in self._columns.values()}) > 1:
            raise ValueError("columns: expected equal lengths")

    @classmethod
    def of_rows(cls, rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Table:
        """A table of records; what a record lacks is None."""
        return cls({name: [row.get(name) for row in rows] for name in names})

    def __getitem__(self, name: str) -> list[Any]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def height(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), []))

    def rows(self) -> list[dict[str, Any]]:
        """One dictionary per row."""
        return [dict(zip(self._columns, row, strict=True)) for row in zip(*self._columns.values(), strict=True)]

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`."""
        return import_module("pandas").DataFrame(self._columns)

    def to_polars(self) -> Any:
        """A `polars.DataFrame`."""
        return import_module("polars").DataFrame(self._columns, strict=False)

    def to_arrow(self) -> Any:
        """A `pyarrow.Table`."""
        return import_module("pyarrow").table(self._columns)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """A stream of Arrow's C interface."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        lines = [[_short(_text(x)) for x in row] for row in zip(*self._columns.values(), strict=True)]
        names = list(self._columns)
        widths = [max(len(x) for x in column) for column in zip(names, *lines, strict=True)]
        return "\n".join("  ".join(x.ljust(w) for x, w in zip(line, widths, strict=True)).rstrip() for line in [names, *lines])

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self._columns)
        rows = zip(*self._columns.values(), strict=True)
        body = "".join("<tr>" + "".join(f"<td>{html.escape(_text(x))}</td>" for x in row) + "</tr>" for row in rows)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:59]}…"


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
