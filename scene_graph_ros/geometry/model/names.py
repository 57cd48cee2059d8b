"""The rule for names of sources, frames, geometries and cameras."""

import re
from typing import Any

from scene_graph_ros.geometry.errors import NameConflictError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["LONGEST_NAME", "InvalidNameError", "canonical_name", "trimmed_name"]

LONGEST_NAME = 255
"""Characters."""


_CAMERA = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
"""What can be part of a topic's name, however long the others are."""


class InvalidNameError(NameConflictError):
    """A name that breaks the rule for names, independent of other names."""


def trimmed_name(what: str, name: Any) -> str:
    """Return ``name`` without spaces, tabs and line ends at its ends: a name to look for.

    ``what`` is named in the error, e.g. ``"geometry"``. Raises InvalidNameError if nothing is
    left, or if the name is not text.
    """
    if not isinstance(name, str):
        raise InvalidNameError(f"the name of a {what} must be text, not {quoted(name)}")
    trimmed = name.strip(" \t\r\n")
    if not trimmed:
        raise InvalidNameError(f"the name of a {what} must not be empty or blank: {quoted(name)}")
    return trimmed


def canonical_name(what: str, name: Any) -> str:
    """Return ``name`` trimmed, if it can be the name of something new.

    It has 1 to 255 characters, which are printable, or tabs: it is one line wherever it is shown.
    As ``source/frame/geometry`` is a path, a source's name has no slash in it, and that
    of a frame or a geometry none at its ends. A camera's name is part of topics' names: up to 64
    letters, digits and '_', no digit first. Raises InvalidNameError.
    """
    trimmed = trimmed_name(what, name)
    broken = _broken_rule(what, trimmed)
    if broken:
        raise InvalidNameError(f"the name of a {what} must {broken}: {quoted(trimmed)}")
    return trimmed


def _broken_rule(what: str, name: str) -> str:
    if len(name) > LONGEST_NAME:
        return f"have at most {LONGEST_NAME} characters"
    if not name.replace("\t", " ").isprintable():
        return "have printable characters only, no line ends or control characters"
    if what == "source" and "/" in name:
        return "have no '/' in it, which ends it in paths"
    if what == "camera" and not _CAMERA.fullmatch(name):
        return "be made of up to 64 letters, digits and '_' with no digit first"
    if name != name.strip("/"):
        return "not begin or end with '/', which separates names in paths"
    return ""
