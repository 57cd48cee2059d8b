"""Which sections of a file of parameters reach which node, by the rules of rcl."""

from __future__ import annotations

from collections.abc import Iterator
import re
from typing import Any

__all__ = ["PARAMETERS_KEY", "full_name", "reaches", "sections_of"]

PARAMETERS_KEY = "ros__parameters"

Path = tuple[str | int, ...]


def sections_of(data: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield each ``ros__parameters`` with its path, in any namespace."""
    if not isinstance(data, dict):
        return
    for key, value in data.items():
        if key == PARAMETERS_KEY:
            yield (*path, key), value
        else:
            yield from sections_of(value, (*path, key))


def full_name(path: Path) -> str:
    """Return the name of the node that a section is for, perhaps with ``*`` and ``**`` in it."""
    return "/" + "/".join(str(key).strip("/") for key in path[:-1])


def reaches(path: Path, node: str) -> bool:
    """Tell whether a section is for a node of this name, with its namespace.

    ``*`` stands for one part of a name, ``**`` for any number of them, also for none.
    """
    parts = [re.escape(part) for part in full_name(path).split("/")[1:]]
    patterns = {re.escape("**"): "(/[^/]+)*", re.escape("*"): "/[^/]+"}
    pattern = "".join(patterns.get(part, f"/{part}") for part in parts)
    return re.fullmatch(pattern, "/" + node.strip("/")) is not None
