"""A planned path in short pieces: their ends, proven clearances and speeds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.node.effects.plan_proof import PathInWorld
from scene_graph_ros.planning.paths.path_points import points_on
from scene_graph_ros.trajectories import BezierCurve

__all__ = ["FAR", "PlanWay", "way_of"]

FAR = 0.1
"""Metres: more is not proven."""

_PIECES = 50
"""Of a path, about; one for each curve of trajectories that have more."""

_PADDINGS = np.linspace(0.0, FAR, 11)
"""Metres, that pieces are proven with."""


class PlanWay(NamedTuple):
    """Pieces of a path."""

    configurations: NDArray[np.float64]
    """``(m + 1, nq)``: at their ends."""
    times: NDArray[np.float64] | None
    """``(m + 1,)`` s, of a trajectory."""
    proven: NDArray[np.float64]
    """``(m,)`` metres, that robots keep from all else on each; 0 where it is not proven free."""


def way_of(world: PathInWorld) -> PlanWay:
    """Return the pieces of a path in a world.

    Each is proven with more and more padding, up to ten centimetres.
    """
    curves, times = world.curves, world.path.times
    sizes = np.linalg.norm(np.diff(curves, axis=1), axis=2).sum(axis=1)
    if times is not None:
        sizes = np.diff(times)
    shares = sizes / (sizes.sum() or 1.0)
    counts = np.maximum(np.rint(_PIECES * shares).astype(int), 1)
    pieces: list[NDArray[np.float64]] = []
    ends = [0.0]
    for k, count in enumerate(counts.tolist()):
        pieces += _parts(world, curves[k], count)
        ends += (k + np.arange(1, count + 1) / count).tolist()
    points = np.array(pieces)
    q = np.concatenate([points[:, 0], points[-1:, -1]])
    at = None if times is None else np.interp(ends, np.arange(len(times)), times)
    return PlanWay(q, at, _proven(world, points))


def _parts(
    world: PathInWorld, curve: NDArray[np.float64], count: int
) -> Iterator[NDArray[np.float64]]:
    """Return the control points of equal parts of a curve ``(m, nq)``."""
    if len(curve) == 2:
        # Floating joints turn along it, which control points don't say.
        q = points_on(world.robots.tree, curve, count + 1)
        yield from np.stack([q[:-1], q[1:]], axis=1)
        return
    rest = BezierCurve(0.0, 1.0, curve)
    for end in np.arange(1, count) / count:
        part, rest = rest.split(float(end))
        yield part.control_points
    yield rest.control_points


def _proven(world: PathInWorld, pieces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the proven clearances ``(m,)`` of pieces ``(m, k, nq)`` from the world."""
    checker = world.checker.clone()
    result, rows = np.zeros(len(pieces)), np.arange(len(pieces))
    for padding in _PADDINGS:
        checker.set_padding_all_robot_environment_pairs(float(padding))
        measures = checker.measure_edges(pieces[rows])
        rows = rows[[measure.completely_free for measure in measures]]
        result[rows] = padding
        if not len(rows):
            break
    return result
