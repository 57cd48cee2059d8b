"""Random solids of bodies with edges and faces in common, written either way round.

Any of them may be a cavity, a body in one, or both for others that it overlaps.
"""

from __future__ import annotations

from constructed_solids import (
    Body,
    convex_body,
    lattice_body,
    moved,
    rotation,
    Solid,
    solid_of_bodies,
)
import numpy as np

__all__ = ["boxes_either_way", "wedges_either_way"]

_TURNED = 0.7
"""The share of bodies that are written inside out."""


def boxes_either_way(rng: np.random.Generator) -> Solid:
    """Return a solid of boxes on a lattice, in a large one or reaching out of it."""
    bodies = [_cube(0.0, 5.0 / 3.0)]
    bodies += [convex_body(lattice_body(rng)) for _ in range(int(rng.integers(2, 5)))]
    return _anywhere(rng, bodies)


def wedges_either_way(rng: np.random.Generator) -> Solid:
    """Return a solid of wedges of a disk in a cube, which have the disk's axis in common."""
    bodies = [_cube(-4.0, 4.0)]
    # Of one radius, wedges have faces in common that do not tell whose they are.
    for radius in rng.permutation([1.0, 1.5, 2.0, 3.0])[: int(rng.integers(2, 5))]:
        first, count = int(rng.integers(8)), int(rng.integers(1, 4))
        angles = (first + np.arange(count + 1)) * np.pi / 4.0
        rim = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        top = 0.0 if rng.random() < 0.3 else 1.0
        ends = [np.column_stack([rim, np.full(len(rim), z)]) for z in (-1.0, top)]
        axis = [(0.0, 0.0, -1.0), (0.0, 0.0, top)]
        bodies.append(convex_body(np.vstack([axis, *ends])))
    return _anywhere(rng, bodies)


def _cube(low: float, high: float) -> Body:
    corners = [(x, y, z) for x in (low, high) for y in (low, high) for z in (low, high)]
    return convex_body(np.array(corners))


def _anywhere(rng: np.random.Generator, bodies: list[Body]) -> Solid:
    turned = [False, *(rng.random(len(bodies) - 1) < _TURNED).tolist()]
    R, scale, origin = rotation(rng), 10.0 ** rng.uniform(-3, 3), rng.normal(size=3)
    bodies = [moved(body, R, scale, origin) for body in bodies]
    return solid_of_bodies(bodies, turned, has_common_edges=True)
