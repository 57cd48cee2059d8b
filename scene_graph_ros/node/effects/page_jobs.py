"""Jobs of a page's session beside the page's own requests."""

from __future__ import annotations

from typing import Any, NamedTuple

from scene_graph_ros.node.world.planned_path import PlannedPath

__all__ = ["NOTHING_HELD", "Found"]

NOTHING_HELD = "no link is held"


class Found(NamedTuple):
    """The end of a search for a motion."""

    result: Any
    """Of the action."""
    path: PlannedPath | None
