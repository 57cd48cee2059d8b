"""Whether recorded messages have the fields of those that are installed, which are to read them.

Fields follow each other in a message's bytes without names, so one that came or went in between
would be taken for another.
"""

from __future__ import annotations

from typing import Any

from rosbags.typesys import get_types_from_msg, TypesysError

from msg_adapters.definitions import definition_with_parts
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["check_layout"]

_OWN = "scene_graph_msgs/"
"""Messages of other packages don't change within a distribution of ROS."""

_REMEDY = "the version that recorded it can replay it"


def check_layout(kind: str, definition: str) -> None:
    """Compare a recorded definition with the installed one.

    Raises ValueError, naming the type, where fields differ, or where none of that name is there.
    Constants and comments may.
    """
    if not kind.startswith(_OWN):
        return
    try:
        installed = _fields(kind, definition_with_parts(kind))
    except (AttributeError, OSError, ValueError) as error:
        raise ValueError(f"{kind} is not there any more: {_REMEDY}") from error
    try:
        recorded = _fields(kind, definition)
    except TypesysError as error:
        raise ValueError(
            f"{kind} is described in no way that is known: {quoted(error)}"
        ) from error
    for part, fields in recorded.items():
        if fields != installed.get(part):
            raise ValueError(f"{part} had other fields than it has now: {_REMEDY}")


def _fields(kind: str, definition: str) -> dict[str, Any]:
    """Return names and types of the fields of a message of ours, and of its parts of ours."""
    types = get_types_from_msg(definition, kind)
    return {part: told[1] for part, told in types.items() if part.startswith(_OWN)}
