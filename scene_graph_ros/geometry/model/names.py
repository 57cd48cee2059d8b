"""Names: trimmed of blanks at both ends, never empty."""

from typing import Any

from scene_graph_ros.geometry.errors import NameConflictError

__all__ = ["canonical_name"]


def canonical_name(what: str, name: Any) -> str:
    """Return ``name`` without spaces and tabs at its ends; blanks inside are kept.

    ``what`` is named in the error, e.g. ``"geometry"``. Raises NameConflictError if nothing is
    left, or if the name is not text.
    """
    if not isinstance(name, str):
        raise NameConflictError(f"the name of a {what} must be text, not {name!r}")
    trimmed = name.strip(" \t\r\n")
    if not trimmed:
        raise NameConflictError(f"the name of a {what} must not be empty or blank: {name!r}")
    return trimmed
