"""Robots whose links whoever looks may drag."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["DraggableRobot"]


class DraggableRobot(NamedTuple):
    """A robot, and the links that joints of it carry."""

    robot: str
    links: tuple[str, ...]
    """From the base outwards."""
    executes: bool
    """Whether its motions may be executed, too."""
