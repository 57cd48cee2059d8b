"""Which closed parts are cavities: inside of an odd number of others, and turned inwards."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["Part", "cavities_among", "may_have_cavities"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_WITHIN = 1e-9
"""Relative to its own volume: as much of a part may be outside of one that it is wholly inside."""


_BESIDE = 1e-12
"""Relative to the size of all: by as much is rounding that a box reaches beyond another one."""

_MIDDLES = 16
"""Triangles whose middles are looked at before whole parts are."""


class Part(NamedTuple):
    """A closed part, oriented outwards."""

    triangles: IntArray
    runs_outwards: int
    """1, or -1 for inwards in the file, or 0 for both ways."""
    volume: float
    lower: FloatArray
    upper: FloatArray
    has_edges_of_two: bool


def may_have_cavities(members: list[Part]) -> bool:
    """Tell whether any part runs against another one in the file."""
    return {1, -1} <= {part.runs_outwards for part in members}


def cavities_among(vertices: FloatArray, members: list[Part], bodies: Sequence[Any]) -> list[bool]:
    """Mark the parts inside of an odd number of others and run against the smallest.

    ``bodies`` are the parts for ``manifold3d``, with None for those that it refuses.
    """
    around: list[list[int]] = [[] for _ in members]
    lower = np.array([part.lower for part in members])
    upper = np.array([part.upper for part in members])
    slack = _BESIDE * float((upper.max(axis=0) - lower.min(axis=0)).max())
    volumes = np.array([part.volume for part in members])
    for k, other in enumerate(members):
        is_candidate = (lower >= other.lower - slack).all(axis=1)
        is_candidate &= (upper <= other.upper + slack).all(axis=1) & (volumes < other.volume)
        for i in np.flatnonzero(is_candidate).tolist():
            if _has_middle_inside(vertices, members[i], other):
                around[i].append(k)
    result = []
    for i, part in enumerate(members):
        against = any(members[k].runs_outwards * part.runs_outwards < 0 for k in around[i])
        # Where nothing runs against it, there is nothing to find out.
        wholly = [
            k
            for k in around[i]
            if against and _is_within(vertices, part, members[k], bodies[i], bodies[k])
        ]
        smallest = min(wholly, key=lambda k: members[k].volume, default=i)
        is_against = members[smallest].runs_outwards * part.runs_outwards < 0
        result.append(is_against and len(wholly) % 2 == 1)
    return result


def _middles(vertices: FloatArray, part: Part, most: int) -> FloatArray:
    """Return the middles of at most so many of a part's triangles, evenly chosen."""
    chosen = part.triangles[:: 1 + len(part.triangles) // most]
    return np.asarray(vertices[chosen].mean(axis=1))


def _has_middle_inside(vertices: FloatArray, part: Part, other: Part) -> bool:
    middles = _middles(vertices, part, _MIDDLES)
    return bool((winding_numbers(middles, vertices, other.triangles) > 0).any())


def _is_within(vertices: FloatArray, part: Part, other: Part, body: Any, around: Any) -> bool:
    """Tell whether a part is wholly inside of another one; bodies are None where refused."""
    if body is not None and around is not None:
        return bool((body - around).volume() <= _WITHIN * part.volume)
    middles = _middles(vertices, part, len(part.triangles))
    return bool((winding_numbers(middles, vertices, other.triangles) > 0).all())
