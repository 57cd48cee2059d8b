"""Checks of the sets that others are made of."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["as_members", "common_dimension", "member"]


def as_members(sets: Any, other: ConvexSet | None, kind: str) -> tuple[ConvexSet, ...]:
    """Return a list of sets, or two, as a tuple. Raises ConvexSetError."""
    given = (sets, other) if other is not None else sets
    if not isinstance(given, Iterable):
        raise ConvexSetError(f"{kind}: sets must be a list of ConvexSets, not {quoted(given)}")
    members = tuple(given)
    for member in members:
        if not isinstance(member, ConvexSet):
            raise ConvexSetError(f"{kind}: sets must be ConvexSets, not {quoted(member)}")
    return members


def common_dimension(members: tuple[ConvexSet, ...], kind: str) -> int:
    """Return the dimension of all members, 0 without any. Raises ConvexSetError."""
    dimensions = {member.ambient_dimension for member in members}
    if len(dimensions) > 1:
        found = [member.ambient_dimension for member in members]
        raise ConvexSetError(f"{kind}: sets must have one ambient dimension, not {found}")
    return dimensions.pop() if dimensions else 0


def member(members: tuple[ConvexSet, ...], index: Any, question: str) -> ConvexSet:
    """Return the set of a number, from 0 on. Raises ConvexSetError where there is none."""
    label = f"{question}: index"
    if not members:
        raise ConvexSetError(f"{label} must be that of a set, but there is none")
    return members[as_whole(index, label, 0, len(members) - 1)]
