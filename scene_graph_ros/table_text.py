"""Tables to be read: as text, as HTML of a notebook, as a pandas DataFrame.

Of columns alone, so that programs without kernels can show tables, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
import html
import itertools
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.missing_package import not_installed

if TYPE_CHECKING:
    import pandas

__all__ = ["ROWS", "UnknownColumnError", "as_html", "as_pandas", "as_text"]

ROWS = 20
"""Rows of a table that are shown."""
_AXES = "xyz"
_MOST_COLUMNS = 4
"""Numbers of a row's entry that are shown themselves."""


class UnknownColumnError(ValueError):
    """A table has no column of this name."""


Columns = Mapping[str, NDArray[Any]]
NameOf = Callable[[int], str]


def as_text(title: str, columns: Columns, ids: Sequence[str], name_of: NameOf) -> str:
    """Return a table of text: names for ids, and a few numbers of each row."""
    count = _length(columns)
    head, rows = _cells(columns, ids, name_of)
    lines = [f"{title}: {count} {'row' if count == 1 else 'rows'}"]
    if rows:
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        for row in (head, *rows):
            cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
            lines.append("  ".join(cells).rstrip())
    if count > ROWS:
        lines.append(f"... and {count - ROWS} more")
    return "\n".join(lines)


def as_html(title: str, columns: Columns, ids: Sequence[str], name_of: NameOf) -> str:
    """Return the same for a notebook."""
    count = _length(columns)
    head, rows = _cells(columns, ids, name_of)
    more = f"<p>... and {count - ROWS} more</p>" if count > ROWS else ""
    body = "".join(_html_row("td", row) for row in rows)
    return (
        f"<p>{html.escape(title)}: {count} {'row' if count == 1 else 'rows'}</p>"
        f"<table><thead>{_html_row('th', head)}</thead><tbody>{body}</tbody></table>{more}"
    )


def as_pandas(
    columns: Columns, ids: Sequence[str], name_of: NameOf, wanted: Sequence[str] | None
) -> pandas.DataFrame:
    """Return a DataFrame of the columns wanted; ``name_A`` is the name for ``id_A``."""
    try:
        import pandas as pd
    except ImportError as error:
        raise ImportError(not_installed("to_pandas", "pandas")) from error
    names = {f"name_{each.removeprefix('id_')}": each for each in ids if each in columns}
    chosen = [*names, *columns] if wanted is None else _checked(wanted, [*names, *columns])
    found: dict[str, Any] = {}
    for name in chosen:
        if name in names:
            found[name] = [name_of(int(value)) for value in columns[names[name]]]
        else:
            found.update(_scalars(name, columns[name]))
    return pd.DataFrame(found)


def _checked(wanted: Sequence[str], known: Sequence[str]) -> list[str]:
    given = [wanted] if isinstance(wanted, str) else list(wanted)
    for name in given:
        if name not in known:
            raise UnknownColumnError(
                f"columns: there is no column {str(name)[:100]!r}, but {', '.join(known)}"
            )
    return given


def _scalars(name: str, column: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Return a column as columns of single numbers: ``p_WCa_x`` and so on."""
    if column.ndim == 1:
        return {name: column}
    places = itertools.product(*map(range, column.shape[1:]))
    is_vector = column.shape[1:] == (3,)
    found = {}
    for place in places:
        ending = _AXES[place[0]] if is_vector else "_".join(map(str, place))
        rows: Any = slice(None)
        found[f"{name}_{ending}"] = column[(rows, *place)]
    return found


def _length(columns: Columns) -> int:
    return len(next(iter(columns.values())))


def _cells(
    columns: Columns, ids: Sequence[str], name_of: NameOf
) -> tuple[list[str], list[list[str]]]:
    """Return the heads, and the rows that are shown."""
    shown = {name: column[:ROWS] for name, column in columns.items() if _is_shown(column)}
    heads = [name.removeprefix("id_") if name in ids else name for name in shown]
    texts = [
        [name_of(int(v)) for v in column] if name in ids else list(map(_entry, column))
        for name, column in shown.items()
    ]
    return heads, [list(row) for row in zip(*texts, strict=True)]


def _is_shown(column: NDArray[Any]) -> bool:
    return column.ndim == 1 or (column.ndim == 2 and column.shape[1] <= _MOST_COLUMNS)


def _entry(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"({', '.join(map(_entry, value))})"
    return f"{value + 0.0:.6g}" if isinstance(value, (float, np.floating)) else str(value)


def _html_row(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"
