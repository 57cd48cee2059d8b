"""Which closed parts are cavities: inside of an odd number of others, and turned inwards.

A part whose faces are flush with those of another one is inside of it: a pocket, or a channel. By
as much as gaps are closed it may reach out, since that is rounding in most files. So it is looked
at with its faces moved inwards by as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.press import moved
from scene_graph_ros.geometry.meshes.solids.triangle_normals import unit_normals
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["Cavities", "Part", "cavities_among", "may_have_cavities"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_WITHIN = 1e-3
"""Relative to the volume of the layer by which a part's faces move inwards: as much of the rest
may be outside of a part that it is wholly inside of."""

_ROUNDING = 2e-12
"""Relative to the size: flush faces are as far apart, in turned meshes."""

_THIN = 0.25
"""The share of a part's volume over its area by which its faces move inwards at most."""

_BESIDE = 1e-3
"""Of the way from a triangle's corner to its middle: a point of that corner."""

_MIDDLES = 16
"""Triangles whose middles are looked at before whole parts are."""


class _Shrunk(NamedTuple):
    """A part whose faces are moved inwards."""

    points: FloatArray
    """(v, 3)."""
    triangles: IntArray
    """(m, 3)."""
    layer: float
    """The volume between its faces and where they were, cubic metres."""


class Part(NamedTuple):
    """A closed part, oriented outwards."""

    triangles: IntArray
    runs_outwards: int
    """1, or -1 for inwards in the file, or 0 for both ways."""
    volume: float
    lower: FloatArray
    upper: FloatArray
    has_edges_of_two: bool
    is_nested: bool = False
    """Whether it winds around points more than once, with walls that the library would leave."""


def may_have_cavities(members: list[Part]) -> bool:
    """Tell whether any part runs against another one in the file."""
    return {1, -1} <= {part.runs_outwards for part in members}


class Cavities(NamedTuple):
    """Which of some parts are cavities."""

    of: list[int]
    """For each part the smallest one that it is a cavity of, or -1."""
    reaching: list[int]
    """The cavities that reach out of a part which they are inside of, by more than rounding."""
    filling: list[int]
    """The parts that are partly inside of one that they run against, and so are no cavities."""


def cavities_among(
    vertices: FloatArray, members: list[Part], bodies: Sequence[Any], tolerance: float
) -> Cavities:
    """Mark the parts inside of an odd number of others and run against the smallest.

    ``bodies`` are the parts for ``manifold3d``, with None for those that it refuses;
    ``tolerance``, metres, is by how much a part may reach out of one that it is inside of.
    """
    around: list[list[int]] = [[] for _ in members]
    lower = np.array([part.lower for part in members])
    upper = np.array([part.upper for part in members])
    rounding = _ROUNDING * float((upper.max(axis=0) - lower.min(axis=0)).max())
    tolerance = max(tolerance, rounding)
    volumes = np.array([part.volume for part in members])
    ways = np.array([part.runs_outwards for part in members])
    shrunk = [_shrunk(vertices, part, tolerance) for part in members]
    partly: list[list[int]] = [[] for _ in members]
    for k, other in enumerate(members):
        is_candidate = (lower <= other.upper).all(axis=1) & (upper >= other.lower).all(axis=1)
        low, high = other.lower - tolerance, other.upper + tolerance
        is_nested = np.asarray((lower >= low).all(axis=1) & (upper <= high).all(axis=1))
        is_candidate &= (volumes < other.volume) & (is_nested | (ways * other.runs_outwards < 0))
        for i in np.flatnonzero(is_candidate).tolist():
            if not _has_middle_inside(shrunk[i], vertices, other):
                continue
            (around if is_nested[i] else partly)[i].append(k)
    of, reaching = [], []
    for i, part in enumerate(members):
        others = {k for k in around[i] if ways[k] * ways[i] < 0}
        # Where nothing runs against it, there is nothing to find out.
        wholly = [
            k
            for k in around[i]
            if others and _is_within(shrunk[i], vertices, members[k], bodies[i], bodies[k])
        ]
        smallest = min(wholly, key=lambda k: members[k].volume, default=i)
        is_against = ways[smallest] * ways[i] < 0
        is_hollow = is_against and len(wholly) % 2 == 1
        of.append(smallest if is_hollow else -1)
        if is_hollow:
            own = _shrunk(vertices, part, rounding)
            if not all(
                _is_within(own, vertices, members[k], bodies[i], bodies[k]) for k in wholly
            ):
                reaching.append(i)
        partly[i] += others - set(wholly)
    # What fills a cavity runs against it, too.
    bodies_at = [any(of[k] < 0 for k in some) for some in partly]
    filling = [i for i, is_at in enumerate(bodies_at) if is_at and of[i] < 0]
    return Cavities(of, reaching, filling)


def _shrunk(vertices: FloatArray, part: Part, step: float) -> _Shrunk:
    """Return a part with its faces moved inwards by a step, metres, or less if it is thin."""
    used, triangles = used_indices(part.triangles, len(vertices))
    points = vertices[used]
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * float(np.linalg.norm(across, axis=1).sum())
    step = min(step, _THIN * part.volume / area)
    steps = np.full(len(triangles), -step)
    return _Shrunk(
        moved(points, triangles, unit_normals(points, triangles), steps), triangles, step * area
    )


def _has_middle_inside(own: _Shrunk, vertices: FloatArray, other: Part) -> bool:
    """Tell whether a part has anything in another one, by a few of its triangles."""
    points, triangles, _ = own
    middles = points[triangles[:: 1 + len(triangles) // _MIDDLES]].mean(axis=1)
    return bool((winding_numbers(middles, vertices, other.triangles) > 0).any())


def _is_within(own: _Shrunk, vertices: FloatArray, other: Part, body: Any, around: Any) -> bool:
    """Tell whether a part is wholly inside of another one; bodies are None where refused."""
    points, triangles, layer = own
    corners = points[triangles]
    middles = corners.mean(axis=1)
    # A corner of planes that are nearly one does not move inwards.
    beside = corners + _BESIDE * (middles[:, None] - corners)
    asked = np.concatenate([middles, beside.reshape(-1, 3)])
    if (winding_numbers(asked, vertices, other.triangles) <= 0).any():
        return False
    if body is None or around is None:
        return True
    # Neither corners nor middles are outside; what is between them may be.
    import manifold3d

    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(points),
        tri_verts=np.ascontiguousarray(triangles, dtype=np.uint64),
    )
    inner = manifold3d.Manifold(mesh)
    if inner.status() != manifold3d.Error.NoError:
        inner = body
    return bool(abs((inner - around).volume()) <= _WITHIN * layer)
