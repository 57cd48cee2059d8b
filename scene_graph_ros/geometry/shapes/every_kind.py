"""Tables that answer one concern for every kind of shape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["every_kind"]

Answer = TypeVar("Answer")


def every_kind(concern: str, answers: Mapping[ShapeKind, Answer]) -> dict[ShapeKind, Answer]:
    """Return the answers of a concern by kind of shape.

    Raises TypeError, which names the concern, where a kind has no answer: when the table's module
    is imported, not when a shape of that kind comes.
    """
    missing = [kind.name for kind in ShapeKind if kind not in answers]
    if missing:
        raise TypeError(f"{concern}: no answer for shapes of kind {', '.join(missing)}")
    return dict(answers)
