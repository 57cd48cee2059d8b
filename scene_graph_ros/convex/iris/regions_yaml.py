"""Regions as YAML, as other programs that plan through regions write and read them.

A mapping of names to ``{A: [[...], ...], b: [...]}``, on request below one key.
"""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, read_limited
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "load_iris_regions_yaml_file",
    "regions_from_document",
    "regions_to_yaml",
    "save_iris_regions_yaml_file",
]

_MOST_NAMES, _LONGEST_NAME = 5, 40
"""Of a file's keys, and their characters, that messages repeat."""

_MOST_DIMENSIONS = 10_000
"""Of which a square matrix still fits in memory."""


def save_iris_regions_yaml_file(
    filename: str | Path, regions: Mapping[str, HPolyhedron], child_name: str | None = None
) -> None:
    """Write regions by name, each number so that it is read as it was.

    With ``child_name`` below that key. Raises ConvexSetError for other objects, OSError where
    the file can't be written.
    """
    path = _path(filename, "save_iris_regions_yaml_file")
    path.write_text(regions_to_yaml(regions, child_name), encoding="utf-8")


def regions_to_yaml(regions: Mapping[str, HPolyhedron], child_name: str | None = None) -> str:
    """Return the text of such a file. Raises ConvexSetError for other objects."""
    import yaml

    label = "save_iris_regions_yaml_file"
    if not isinstance(regions, Mapping):
        raise ConvexSetError(
            f"{label}: regions must be a mapping of names to regions, not {quoted(regions)}"
        )
    _check_child_name(child_name, label)
    document: dict[str, Any] = {}
    for name, region in regions.items():
        if not isinstance(region, HPolyhedron):
            raise ConvexSetError(
                f"{label}: regions[{name!r}] must be an HPolyhedron, not {quoted(region)}"
            )
        document[str(name)] = {
            "ambient_dimension": region.ambient_dimension,
            "A": region.A.tolist(),
            "b": region.b.tolist(),
        }
    whole = document if child_name is None else {child_name: document}
    # Numbers of a row on a line; the names in their order.
    return yaml.safe_dump(
        whole, default_flow_style=None, sort_keys=False, width=1 << 20, allow_unicode=True
    )


def load_iris_regions_yaml_file(
    filename: str | Path, child_name: str | None = None
) -> dict[str, HPolyhedron]:
    """Read regions by name, in the file's order; with ``child_name`` those below that key.

    Raises ConvexSetError, which names the file and the entry, for malformed regions; OSError where
    the file can't be read.
    """
    import yaml

    path = _path(filename, "load_iris_regions_yaml_file")
    _check_child_name(child_name, "load_iris_regions_yaml_file")
    try:
        document = yaml.safe_load(read_limited(path, MAX_TEXT_BYTES))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        # Dates that are none are a ValueError, what is nested too deeply is the last.
        raise ConvexSetError(f"{path}: no YAML: {error}") from None
    return regions_from_document(document, str(path), child_name)


def _path(filename: Any, label: str) -> Path:
    if not isinstance(filename, (str, os.PathLike)):
        raise ConvexSetError(f"{label}: filename must be a path, not {quoted(filename)}")
    return Path(filename)


def _check_child_name(child_name: Any, label: str) -> None:
    if child_name is not None and not isinstance(child_name, str):
        raise ConvexSetError(
            f"{label}: child_name must be a key's name or None, not {quoted(child_name)}"
        )


def regions_from_document(
    document: Any, where: str, child_name: str | None = None
) -> dict[str, HPolyhedron]:
    """Return the regions of a parsed YAML text; ``where`` is its name in errors.

    Raises ConvexSetError for malformed regions.
    """
    if child_name is not None:
        document = _entry(document, child_name, where)
    if not isinstance(document, dict):
        raise ConvexSetError(f"{where}: regions must be a mapping of names, not {_kind(document)}")
    return {str(name): _region(each, f"{where}: {_name(name)}") for name, each in document.items()}


def _kind(value: Any) -> str:
    """Name the kind of a value of a file: the file may be about something else."""
    return f"a value of type {type(value).__name__}"


def _name(key: Any) -> str:
    text = str(key)
    return text if len(text) <= _LONGEST_NAME else f"{text[:_LONGEST_NAME]}..."


def _entry(mapping: Any, key: str, where: str) -> Any:
    if not isinstance(mapping, dict) or key not in mapping:
        raise ConvexSetError(f"{where} has no {key!r}; it {_content(mapping)}")
    return mapping[key]


def _content(value: Any) -> str:
    if not isinstance(value, dict):
        return f"is {_kind(value)}"
    more = ", and others" if len(value) > _MOST_NAMES else ""
    return f"has {', '.join(map(_name, list(value)[:_MOST_NAMES])) or 'nothing'}{more}"


def _region(value: Any, where: str) -> HPolyhedron:
    rows, sides = _entry(value, "A", where), _entry(value, "b", where)
    try:
        A, b = np.array(rows, dtype=np.float64), np.array(sides, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ConvexSetError(f"{where}: A and b must be rows of numbers") from None
    n = value.get("ambient_dimension", A.shape[-1] if A.ndim else None)
    is_whole = isinstance(n, int) and not isinstance(n, bool)
    if not A.size and not b.size and is_whole and 0 <= n <= _MOST_DIMENSIONS:
        # No rows: all points.
        A = np.zeros((0, n))
    if A.ndim != 2 or not is_whole or A.shape[1] != n:
        raise ConvexSetError(
            f"{where}: A has the shape {A.shape}, ambient_dimension is {quoted(n)[:_LONGEST_NAME]}"
        )
    return HPolyhedron(A, b)
