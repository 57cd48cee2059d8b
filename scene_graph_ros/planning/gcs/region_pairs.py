"""Pairs of regions of subgraphs that meet, with their vertices' bounds."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_vector, as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.intersection import Intersection
from scene_graph_ros.convex.sets.pairwise_intersections import (
    check_widths,
    compute_pairwise_intersections,
    own_box,
    translated,
)
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.gcs.subgraph import Subgraph

__all__ = ["GivenPairs", "Meeting", "as_pairs", "meetings_between", "meetings_inside"]

GivenPairs = tuple[list[tuple[int, int]], list[np.ndarray] | None]
"""The numbers of two regions each, and the offsets ``(n,)`` of the first, where they are given."""

_TURN = 2.0 * np.pi


class Meeting(NamedTuple):
    """Two regions that meet, and how they are turned to do so."""

    first: int
    second: int
    offset: np.ndarray
    """``(n,)``: the first region is moved by it."""
    turn: np.ndarray
    """``(n,)``: the subspace in which they meet is moved by it."""


def meetings_inside(
    subgraph: Subgraph, joints: Sequence[int], given: GivenPairs | None
) -> list[Meeting]:
    """Return the regions of a subgraph that meet, in both orders. Raises ConvexSetError."""
    found = _meetings(subgraph, None, joints, given)
    return [Meeting(i, j, offset, np.zeros(len(offset))) for (i, j), offset in found]


def meetings_between(
    first: Subgraph,
    second: Subgraph,
    joints: Sequence[int],
    subspace: ConvexSet | None,
    given: GivenPairs | None,
) -> list[Meeting]:
    """Return the regions of two subgraphs that meet, in a subspace if there is one.

    Regions that are given and do not meet there are joined, too: no way leads along their edge.
    """
    found = _meetings(first, second, joints, given)
    meetings = []
    for (i, j), offset in found:
        turn: np.ndarray | None = np.zeros(len(offset))
        if subspace is not None:
            both = translated(first.regions[i], offset), second.regions[j]
            box = _box(second, j)
            turn = _turn_of(subspace, both, (box.lb, box.ub), joints)
            if turn is None and given is not None:
                turn = np.zeros(len(offset))
        if turn is not None:
            meetings.append(Meeting(i, j, offset, turn))
    return meetings


def _meetings(
    first: Subgraph, second: Subgraph | None, joints: Sequence[int], given: GivenPairs | None
) -> list[tuple[tuple[int, int], np.ndarray]]:
    """Return pairs of regions, and the offsets ``(n,)`` with which they meet."""
    boxes = [None if of is None else _boxes(of) for of in (first, second)]
    other = first if second is None else second
    if given is None:
        found = compute_pairwise_intersections(
            first.regions,
            None if second is None else second.regions,
            joints,
            bboxes_A=boxes[0],
            bboxes_B=boxes[1],
        )
        return list(zip(*found, strict=True))
    for of, around in ((first, boxes[0]), (second, boxes[1])):
        if of is not None and around is not None:
            corners = np.array([box.lb for box in around]), np.array([box.ub for box in around])
            check_widths(corners, list(joints), f"{of.name}: regions")
    pairs, offsets = given
    if offsets is None:
        offsets = [_offset(first, i, other, j, joints) for i, j in pairs]
    return list(zip(pairs, offsets, strict=True))


def _offset(
    first: Subgraph, i: int, second: Subgraph, j: int, joints: Sequence[int]
) -> np.ndarray:
    """Return the whole turns ``(n,)`` after which a region meets another, none if it doesn't."""
    if not joints:
        return np.zeros(first.variables.num_positions)
    _, offsets = compute_pairwise_intersections(
        [first.regions[i]],
        [second.regions[j]],
        joints,
        bboxes_A=[_box(first, i)],
        bboxes_B=[_box(second, j)],
    )
    return offsets[0] if offsets else np.zeros(first.variables.num_positions)


def _turn_of(
    subspace: ConvexSet,
    regions: tuple[ConvexSet, ConvexSet],
    box: tuple[np.ndarray, np.ndarray],
    joints: Sequence[int],
) -> np.ndarray | None:
    """Return the whole turns ``(n,)`` after which a subspace has a point of both regions.

    ``box`` is around the second region. The fewest turns are tried first; a subspace without an
    end along a joint is not turned about it. None where there are none.
    """
    n = subspace.ambient_dimension
    counts: list[Sequence[int]] = [(0,)] * n
    if not subspace.is_empty():
        for joint in joints:
            axis = np.eye(n)[joint]
            low, high = -subspace.support(-axis).value, subspace.support(axis).value
            if np.isfinite(low) and np.isfinite(high):
                least = int(np.floor((box[0][joint] - high) / _TURN))
                most = int(np.ceil((box[1][joint] - low) / _TURN))
                counts[joint] = range(least, most + 1)
    by_size = sorted(itertools.product(*counts), key=lambda turns: np.abs(turns).sum())
    for turns in by_size:
        turn = _TURN * np.array(turns, dtype=float)
        if not Intersection([*regions, translated(subspace, turn)]).is_empty():
            return turn
    return None


def _boxes(subgraph: Subgraph) -> list[Hyperrectangle]:
    """Return boxes around regions, which their vertices know."""
    return [_box(subgraph, k) for k in range(subgraph.size)]


def _box(subgraph: Subgraph, k: int) -> Hyperrectangle:
    box = own_box(subgraph.regions[k])
    if box is None:
        n, placed = subgraph.variables.num_positions, subgraph.vertices[k].placed
        box = placed.center[:n] - placed.half[:n], placed.center[:n] + placed.half[:n]
    return Hyperrectangle(*box)


def as_pairs(
    pairs: Any, offsets: Any, sizes: tuple[int, int], num_positions: int, label: str
) -> GivenPairs:
    """Return pairs of indices below ``sizes``, and offsets ``(n,)``. Raises ConvexSetError."""
    found: list[tuple[int, int]] = []
    for k, pair in enumerate(pairs):
        if not isinstance(pair, Sequence | np.ndarray) or len(pair) != 2:
            raise ConvexSetError(
                f"{label}: edges_between_regions[{k}] must be a pair of indices,"
                f" not {quoted(pair)}"
            )
        ends = [
            as_whole(index, f"{label}: edges_between_regions[{k}][{side}]", 0)
            for side, index in enumerate(pair)
        ]
        for side, (index, size) in enumerate(zip(ends, sizes, strict=True)):
            if index >= size:
                raise ConvexSetError(
                    f"{label}: edges_between_regions[{k}][{side}] must be below {size}, the number"
                    f" of regions, not {index}"
                )
        found.append((ends[0], ends[1]))
    if offsets is None:
        return found, None
    if len(offsets) != len(found):
        raise ConvexSetError(
            f"{label}: edge_offsets must be as many as edges_between_regions, {len(found)}, not"
            f" {len(offsets)}"
        )
    return found, [
        as_vector(offset, f"{label}: edge_offsets[{k}]", num_positions)
        for k, offset in enumerate(offsets)
    ]
