"""Bodies for ``manifold3d``, and the boundary of their union, but for cavities.

Cavities are taken out of their parts first. Points in m cavities of one part then wind m - 1 times
less than they do around the rest of it. With U_k the points in k or more of those parts, and V_k
those that wind k times less or more, the solid is the union of all U_k - V_k.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.cavities import Part
from scene_graph_ros.geometry.meshes.solids.pairing import with_pairs_apart
from scene_graph_ros.geometry.meshes.solids.press import PRESSED

__all__ = ["bodies_of", "boundary_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_TOUCHING = 1e-9
"""Relative to a body's volume: as much it has in common with another one that it only touches."""

_THIN = 4.0
"""Of PRESSED: the volume over the area of what bodies that only touch have in common is half of
its thickness, which is four times as much at most."""


def boundary_of(
    bodies: Sequence[Any], cavity_of: Sequence[int], grown: Sequence[Any], size: float
) -> tuple[FloatArray, IntArray]:
    """Return the boundary, points (v, 3) and triangles (m, 3), of the solid of manifolds.

    ``cavity_of`` has for each the body that it is a cavity of, or -1; ``grown`` are the cavities
    as they count for what they have in common (``press``). ``size`` is the largest coordinate.
    """
    import manifold3d

    solids, hollows = _hollowed(bodies, cavity_of, grown)
    whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if hollows:
        out = _levels(hollows, len(hollows))
        # Where there is no cavity, it is enough to be in one of the others.
        apart = _without_contacts(_beside(solids, hollows), _THIN * PRESSED * size)
        inside = [whole, *_levels(apart, len(out) + 1)[1:]]
        out.append(manifold3d.Manifold())
        whole = manifold3d.Manifold.batch_boolean(
            [u - v for u, v in zip(inside, out, strict=False)], manifold3d.OpType.Add
        )
    mesh = whole.to_mesh64()
    points = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    triangles = np.array(mesh.tri_verts, dtype=np.int64).reshape(-1, 3)
    return points, triangles


def _hollowed(
    bodies: Sequence[Any], cavity_of: Sequence[int], grown: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """Return the bodies without their cavities, and of each what is in k of these, k > 1."""
    import manifold3d

    solids, common = [], []
    for k, of in enumerate(cavity_of):
        rows = [i for i, parent in enumerate(cavity_of) if parent == k]
        own, wide = [bodies[i] for i in rows], [grown[i] for i in rows]
        if of < 0:
            cut = manifold3d.OpType.Subtract
            solids.append(manifold3d.Manifold.batch_boolean([bodies[k], *own], cut))
        elif own:
            common += wide
        least = _TOUCHING * min((body.volume() for body in own), default=0.0)
        common += [both for both in _levels(wide, len(wide))[1:] if abs(both.volume()) > least]
    return solids, common


def _without_contacts(bodies: Sequence[Any], thickness: float) -> list[Any]:
    """Return bodies, those united that have no more in common than pressing makes of contact.

    So points where they are pressed into each other are in one body, not in two.
    """
    result: list[Any] = []
    for body in bodies:
        least, chosen = 1.0, None
        for k, other in enumerate(result):
            both = other ^ body
            area = both.surface_area()
            if both.volume() > thickness * area:
                continue
            # One that it touches rather than one that it is away from.
            if chosen is None or (area > 0.0 and least == 0.0):
                least, chosen = area, k
        if chosen is None:
            result.append(body)
        else:
            result[chosen] += body
    return result


def bodies_of(vertices: FloatArray, members: list[Part]) -> list[Any]:
    """Return parts for the library, with None for those that it refuses or that are nested."""
    return [None if part.is_nested else _body(vertices, part) for part in members]


def _body(vertices: FloatArray, part: Part) -> Any:
    """Return a part for the library, or None if it refuses it."""
    import manifold3d

    used, faces = used_indices(part.triangles, len(vertices))
    points = vertices[used]
    # A vertex of several fans the library sets apart itself.
    if not part.has_edges_of_two:
        points, faces = with_pairs_apart(points, faces)
    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(points),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
    )
    body = manifold3d.Manifold(mesh)
    return body if body.status() == manifold3d.Error.NoError else None


def _beside(bodies: Sequence[Any], others: Sequence[Any]) -> list[Any]:
    """Return the bodies whose boxes meet the box of any other one."""
    own = np.array([body.bounding_box() for body in bodies]).reshape(-1, 6)
    boxes = np.array([body.bounding_box() for body in others]).reshape(-1, 6)
    is_below = (own[:, None, :3] <= boxes[None, :, 3:]).all(axis=2)
    is_above = (own[:, None, 3:] >= boxes[None, :, :3]).all(axis=2)
    rows = np.unique(np.nonzero(is_below & is_above)[0])
    return [bodies[k] for k in rows.tolist()]


def _levels(bodies: Sequence[Any], most: int) -> list[Any]:
    """Return, for k from 1 to at most ``most``, the points that are in k or more of the bodies.

    Halves of the bodies are counted first: points in k of all are in i of the one half, and in
    k - i of the other. So most intersections are of few triangles.
    """
    levels = [[body] for body in bodies]
    while len(levels) > 1:
        left = levels[-1:] if len(levels) % 2 else []
        pairs = zip(levels[::2], levels[1::2], strict=False)
        levels = [_levels_of_both(one, other, most) for one, other in pairs] + left
    return levels[0] if levels else []


def _levels_of_both(one: list[Any], other: list[Any], most: int) -> list[Any]:
    """Return, for k up to ``most``, the points that are in k or more of two halves together."""
    import manifold3d

    result: list[Any] = []
    for k in range(1, min(most, len(one) + len(other)) + 1):
        terms = [one[k - 1]] if k <= len(one) else []
        terms += [other[k - 1]] if k <= len(other) else []
        terms += [
            one[i - 1] ^ other[k - i - 1]
            for i in range(max(1, k - len(other)), min(len(one), k - 1) + 1)
        ]
        level = manifold3d.Manifold.batch_boolean(terms, manifold3d.OpType.Add)
        if level.is_empty():
            break
        result.append(level)
    return result
