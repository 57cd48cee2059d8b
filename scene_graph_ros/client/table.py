"""Answers as tables: columns by name, and rows."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.table_text import as_html, as_pandas, as_text

if TYPE_CHECKING:
    import pandas

__all__ = ["Table"]


class Table(Sequence[Any]):
    """Rows with named fields; each column is an array of the same name.

    ``print`` shows the rows, a notebook a table, and ``to_pandas`` returns a DataFrame.
    """

    def __init__(self, title: str, columns: Mapping[str, Any]) -> None:
        """Take columns of equal length."""
        self._title = title
        self.columns: dict[str, NDArray[Any]] = {k: np.asarray(v) for k, v in columns.items()}
        self._row = namedtuple(title, list(columns))  # type: ignore[misc]

    def __getattr__(self, name: str) -> NDArray[Any]:
        columns = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(f"{type(self).__name__} has no column {name!r}")
        found: NDArray[Any] = columns[name]
        return found

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.columns]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return Table(self._title, {k: v[index] for k, v in self.columns.items()})
        place = range(len(self))[index]
        values = (column[place] for column in self.columns.values())
        return self._row(*(v if isinstance(v, np.ndarray) else v.item() for v in values))

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def to_pandas(self, columns: Sequence[str] | None = None) -> pandas.DataFrame:
        """Return a ``pandas.DataFrame`` of some columns, or of all.

        Raises UnknownColumnError, a ValueError, and ImportError where pandas is not installed.
        """
        return as_pandas(self.columns, (), str, columns)

    def __repr__(self) -> str:
        return f"<{self._title}: {len(self)} x ({', '.join(self.columns)})>"[:200]

    def __str__(self) -> str:
        return as_text(self._title, self.columns, (), str)

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(str(self))

    def _repr_html_(self) -> str:
        return as_html(self._title, self.columns, (), str)
