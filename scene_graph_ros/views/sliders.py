"""Joints that whoever looks may move: between which ends, and where they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

__all__ = ["Slider", "SliderState"]


class Slider(NamedTuple):
    """A joint whose position is one number."""

    robot: str
    joint: str
    lower: float
    upper: float
    unit: str
    """Of all these numbers: rad or m."""


class SliderState(NamedTuple):
    """How the joints are at one time."""

    positions: tuple[float, ...] = ()
    """Of each slider, in their order."""
    refused: Mapping[str, str] = {}
    """Why the joints of a robot can't be moved, by its name."""
