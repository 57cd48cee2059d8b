"""The one predicate of regions: which configurations are free."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.carried_checker import PackedChecker
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.parallel.deadline import Deadline, ENDLESS
from scene_graph_ros.planning.regions.errors import RegionError
from scene_graph_ros.planning.regions.parameterization import IrisParameterizationFunction

__all__ = [
    "Constraints",
    "Feasibility",
    "checked_constraints",
    "checked_obstacles",
    "feasibility_of_share",
]

Constraints: TypeAlias = Callable[[NDArray[np.float64]], Any]
"""Of configurations ``(n, nq)`` returns ``(n, k)``: all of a row must be at most 0."""


_NONE = "no region was found"


class NearToPoint(NamedTuple):
    """Pairs at a region's point."""

    distances: NDArray[np.float64]
    """``(m,)``."""
    jacobians: NDArray[np.float64]
    """``(m, k)``."""
    pairs: Sequence[Any]


class Feasibility:
    """Tells which configurations are free; sampling, visibility, growth and tests ask it alone.

    A free one is free to the checker with its paddings, in no obstacle of the configuration space,
    and meets all constraints.
    """

    def __init__(
        self,
        checker: Any,
        obstacles: Sequence[ConvexSet] = (),
        constraints: Constraints | None = None,
        threads: int = 1,
        parameterization: IrisParameterizationFunction | None = None,
        deadline: Deadline = ENDLESS,
    ) -> None:
        """Take an object with ``check_configs_collision_free``, and the checked options.

        Where the ``deadline`` is over, no question is answered any more.
        """
        self.deadline = deadline
        self.parameterization = parameterization
        self.checker, self.obstacles, self.constraints = checker, tuple(obstacles), constraints
        self.threads = threads
        self.asked = 0

    def configurations(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the configurations ``(n, nq)`` of a region's points ``(n, k)``.

        Raises RegionError for a parameterization that returns something else.
        """
        if self.parameterization is None:
            return points
        return self.parameterization.configurations(points, self._nq())

    def _nq(self) -> int:
        return int(self.checker.model.tree.num_positions)

    def free(self, q: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell of configurations ``(n, nq)``, or of a region's points, which are free.

        Raises OutOfTimeError.
        """
        self.deadline.check(_NONE)
        self.asked += len(q)
        if not len(q):
            return np.zeros(0, dtype=np.bool_)
        q = self.configurations(q)
        result = np.array(
            self.checker.check_configs_collision_free(q, threads=self.threads), dtype=np.bool_
        )
        for obstacle in self.obstacles:
            result &= ~np.asarray(obstacle.point_in_set(q, 0.0))
        if self.constraints is not None:
            result &= self._meets(q)
        return result

    def segments_free(self, edges: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell of straight edges ``(n, 2, nq)`` which are free.

        The checker proves them where it can. Obstacles must not meet them; constraints are asked
        at 16 places on each. Raises OutOfTimeError.
        """
        self.deadline.check(_NONE)
        free = np.array(
            self.checker.check_edges_collision_free(edges, threads=self.threads), dtype=np.bool_
        )
        for obstacle in self.obstacles:
            for k in np.flatnonzero(free):
                free[k] = not _meets_segment(obstacle, *edges[k])
        if self.constraints is not None and len(edges):
            shares = np.linspace(0.0, 1.0, 16)[:, np.newaxis, np.newaxis]
            between = (1.0 - shares) * edges[:, 0] + shares * edges[:, 1]
            met = self._meets(between.reshape(-1, edges.shape[2]))
            free &= met.reshape(len(shares), len(edges)).all(axis=0)
        return free

    def near(self, q: NDArray[np.float64], influence: float) -> Any:
        """Return ``distances (k,)``, ``jacobians`` and ``pairs`` at q, up to one (m), padded.

        At a region's point derivatives are by its coordinates, and obstacles are among the pairs,
        by their numbers, with distances in rad or m.
        """
        if self.parameterization is None:
            return self.checker.calc_robot_clearance(q, influence)
        (at,) = self.configurations(q[np.newaxis])
        (slopes,) = self.parameterization.derivatives(q[np.newaxis], len(at))
        near = self.checker.calc_robot_clearance(at, influence)
        distances, jacobians = list(near.distances), list(near.jacobians)
        pairs: list[Any] = list(near.pairs)
        for k, obstacle in enumerate(self.obstacles):
            found = obstacle.projection(at)
            if found is None:
                continue
            way = at - found.points[0]
            length = float(np.linalg.norm(way))
            if length > 0.0:
                distances.append(length)
                jacobians.append(way / length)
                pairs.append(k)
        rows = np.array(jacobians).reshape(-1, len(at))
        return NearToPoint(np.array(distances), rows @ slopes, pairs)

    def _meets(self, q: NDArray[np.float64]) -> NDArray[np.bool_]:
        assert self.constraints is not None
        given = self.constraints(q)
        values = real_array(given, "additional_constraints must return numbers", RegionError)
        if values.ndim == 1:
            values = values[:, np.newaxis]
        if values.ndim != 2 or len(values) != len(q) or np.isnan(values).any():
            raise RegionError(
                f"additional_constraints must return numbers ({len(q)}, k) of"
                f" {len(q)} configurations, not {quoted(given)}"
            )
        return np.asarray((values <= 0.0).all(axis=1), dtype=np.bool_)


def _meets_segment(obstacle: ConvexSet, q1: NDArray[np.float64], q2: NDArray[np.float64]) -> bool:
    from scene_graph_ros.convex.sets.v_polytope import VPolytope

    return bool(obstacle.intersects_with(VPolytope(np.stack([q1, q2]))))


def feasibility_of_share(
    asked: CollisionChecker | PackedChecker,
    options: Any,
    threads: int,
    deadline: Deadline = ENDLESS,
) -> Feasibility:
    """Return the predicate of one worker."""
    checker: Any = asked.unpacked() if isinstance(asked, PackedChecker) else asked
    return Feasibility(
        checker,
        getattr(options, "configuration_obstacles", ()),
        getattr(options, "additional_constraints", None),
        threads,
        deadline=deadline,
    )


def checked_obstacles(obstacles: Any, dimension: int) -> tuple[ConvexSet, ...]:
    """Return obstacles of the configuration space. Raises RegionError."""
    try:
        result = tuple(obstacles)
    except TypeError:
        result = (None,)
    for k, each in enumerate(result):
        if not isinstance(each, ConvexSet) or each.ambient_dimension != dimension:
            raise RegionError(
                f"configuration_obstacles[{k}] must be a ConvexSet in {dimension} dimensions, not"
                f" {quoted(each)}"
            )
    return result


def checked_constraints(constraints: Any) -> Constraints | None:
    """Return constraints, or None. Raises RegionError for objects that cannot be called."""
    if constraints is not None and not callable(constraints):
        raise RegionError(
            f"additional_constraints must be a function, or None, not {quoted(constraints)}"
        )
    result: Constraints | None = constraints
    return result
