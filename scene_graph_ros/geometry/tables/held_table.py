"""A shape table that is handed to a kernel as one array; see ``held_tuples``."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from scene_graph_ros.geometry.compiled.held_tuples import borrower, compiled_type, write_down
from scene_graph_ros.geometry.tables.table_arrays import empty_table, ShapeTable

__all__ = ["HeldTable", "borrowed_table", "hold"]


class HeldTable(NamedTuple):
    """A table and where its arrays are; these are right as long as the table lives."""

    table: ShapeTable
    places: Any
    """What ``borrowed_table`` takes."""


@functools.cache
def _table_type() -> Any:
    """Return the type of every table, to compiled code."""
    return compiled_type(empty_table())


def hold(table: ShapeTable) -> HeldTable:
    """Write down where the arrays of a table of ``build_shape_table`` are.

    Raises:
        TypeError: an array has another type, order or number of axes, or is read-only.

    """
    kind = compiled_type(table)
    if kind != _table_type():
        raise TypeError(f"not a table of build_shape_table: {kind}")
    return HeldTable(table, write_down(table))


borrowed_table = borrower(_table_type)
"""Return, in a lean kernel, the table that the ``places`` of a HeldTable describe."""
