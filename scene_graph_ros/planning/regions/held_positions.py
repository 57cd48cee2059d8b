"""Some positions of robots by themselves, while all others stay where they are."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["Held", "HeldChecker", "held_by_group"]


class Held(NamedTuple):
    """Which positions are asked about, and where the others are."""

    rows: NDArray[np.intp]
    """``(k,)``: entries of q that move."""
    q: NDArray[np.float64]
    """``(nq,)``: all others are as in this one."""

    def whole(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return configurations ``(..., nq)`` of the positions that move ``(..., k)``."""
        result = np.empty((*points.shape[:-1], len(self.q)))
        result[:] = self.q
        result[..., self.rows] = points
        return result


class HeldChecker:
    """A checker of the moving positions ``(k,)`` alone, for regions."""

    def __init__(self, checker: Any, held: Held) -> None:
        """Take a checker of configurations ``(nq,)``."""
        self._checker, self._held = checker, held

    @property
    def snapshot(self) -> Any:
        """The moment that the checker is about, for the names of geometries."""
        return self._checker.snapshot

    def check_configs_collision_free(
        self, configurations: NDArray[np.float64], *, threads: int = 1
    ) -> Any:
        """Tell of ``(n, k)`` which are free."""
        whole = self._held.whole(configurations)
        return self._checker.check_configs_collision_free(whole, threads=threads)

    def check_edges_collision_free(self, edges: NDArray[np.float64], *, threads: int = 1) -> Any:
        """Tell of straight edges ``(n, 2, k)`` which are free."""
        whole = self._held.whole(edges)
        return self._checker.check_edges_collision_free(whole, threads=threads)

    def calc_robot_clearance(self, q: NDArray[np.float64], influence_distance: float) -> Any:
        """Return padded distances at ``(k,)`` up to one (m), with derivatives ``(m, k)``."""
        found = self._checker.calc_robot_clearance(self._held.whole(q), influence_distance)
        return _Near(found.distances, found.jacobians[:, self._held.rows], found.pairs)

    def find_collisions(self, configurations: NDArray[np.float64]) -> Any:
        """Return the collisions at ``(n, k)``, by the checker."""
        return self._checker.find_collisions(self._held.whole(configurations))


class _Near(NamedTuple):
    """Pairs of geometries that are near."""

    distances: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    pairs: tuple[tuple[Any, Any], ...]


def held_by_group(
    checker: CollisionChecker, group: str | None, q: NDArray[np.float64], name: str
) -> Held | None:
    """Return a group's moving positions at configurations ``(m, nq)``; None for all positions.

    Raises KinematicTreeError for a group that there is not, RegionError where another position is
    not the same in all configurations.
    """
    if group is None:
        return None
    tree = checker.model.tree
    rows = tree.group_positions(group)
    others = np.setdiff1d(np.arange(tree.num_positions), rows)
    moved = others[np.ptp(q[:, others], axis=0) > 0.0]
    if len(moved):
        raise RegionError(
            f"{name} moves position {tree.position_names[moved[0]]!r}, which is not of group"
            f" {group!r}"
        )
    return Held(rows, q[0].copy())
