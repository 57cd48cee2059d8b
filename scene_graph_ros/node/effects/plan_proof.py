"""Whether a path that was planned still holds in the world as it is; imported after a plan."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import EdgeMeasure, EdgeStatus, SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.start_overlap import start_overlap_of

__all__ = ["PathInWorld", "PathProof", "Stop"]


class Stop(NamedTuple):
    """An obstacle on a path: its place, the pair of geometries, and the depth."""

    edge: int
    at: float
    """On the edge, from 0 to 1."""
    seconds: float | None
    """When that is on a trajectory."""
    configuration: NDArray[np.float64]
    """``(nq,)``."""
    pair: tuple[Any, Any]
    """Geometry ids, the smaller first."""
    depth: float
    """Metres by which they are nearer than their padding."""


class PathProof(NamedTuple):
    """Whether a path is free, and why not."""

    holds: bool
    reason: str
    least_clearance: float
    stop: Stop | None


class PathInWorld:
    """A path among all else as one snapshot has it.

    The positions that were to move are the path's, all others the robots' in the snapshot. Raises
    UnknownIdError where the scene has not the robots any more that it was planned for.
    """

    def __init__(self, path: PlannedPath, snapshot: WorldSnapshot) -> None:
        core = snapshot.query.snapshot
        self.path, self.snapshot = path, snapshot
        self.robots: PlanningRobots = snapshot.robots.planning(core, snapshot.bases)
        if self.robots.tree.position_names != path.position_names:
            raise UnknownIdError("the scene has other robots than those that it was planned for")
        self.checker: SceneGraphCollisionChecker = self.robots.checker(
            core, environment_padding=path.environment_padding, self_padding=path.self_padding
        )
        present = self.robots.present(snapshot.positions)
        self.configurations, self.curves = (
            _moved(present, each, path.moving) for each in (path.configurations, path.curves)
        )

    def is_as(self, other: PathInWorld) -> bool:
        """Tell whether a proof for one is one for the other: nothing that matters is elsewhere."""
        own, theirs = self.checker.plan, other.checker.plan
        bodies, others = own.bodies, theirs.bodies
        ours, others_now = own.shapes, theirs.shapes
        clouds = zip(
            (*ours.clouds, *ours.fields), (*others_now.clouds, *others_now.fields), strict=True
        )
        return (
            self.path is other.path
            and self.robots is other.robots
            and np.array_equal(self.curves, other.curves)
            and np.array_equal(bodies.X_WG, others.X_WG)
            and np.array_equal(bodies.X_JG, others.X_JG)
            and all(one is another for one, another in clouds)
        )

    @made_once
    def carried(self) -> Any:
        """The frames that links carry; see `PlanningRobots.carried`."""
        return self.robots.carried(self.snapshot.query.snapshot)

    def prove(self) -> PathProof:
        """Prove each edge, or find the first that is not free.

        Of edges that lead out of a collision it is proven that no pair gets deeper.
        """
        k = self.path.free_from
        measures = self._leading() + self.checker.measure_edges(self.curves[k:])
        for edge, measure in enumerate(measures):
            if not measure.completely_free:
                return self._stopped(edge, measure)
        free = [each.least_clearance for each in measures[k:]]
        return PathProof(True, "", min(free, default=0.0), None)

    def _leading(self) -> list[EdgeMeasure]:
        """Return the measures of the edges that lead out, from the start as it is."""
        curves = self.curves[: self.path.free_from]
        if not len(curves):
            return []
        overlap = start_overlap_of(self.checker, self.configurations[0])
        return (self.checker if overlap is None else overlap.checker).measure_edges(curves)

    def _stopped(self, edge: int, measure: EdgeMeasure) -> PathProof:
        assert measure.configuration is not None
        assert measure.pair is not None
        assert measure.at is not None
        first, second = sorted(measure.pair)
        at, times = measure.at, self.path.times
        seconds = None
        if times is not None:
            seconds = float(times[edge] + at * (times[edge + 1] - times[edge]))
        depth = self.checker.calc_pair_depth(measure.configuration, measure.pair)
        stop = Stop(edge, at, seconds, measure.configuration, (first, second), depth)
        names = self.snapshot.names
        who = f"{names.geometry_path(first)} and {names.geometry_path(second)}"
        what = "are too near for a proof"
        if measure.status is EdgeStatus.COLLIDES:
            padded = bool(self.checker.plan.pairs.paddings.any())
            millimetres = f"{1e3 * depth:.4g} mm"
            what = (
                f"are {millimetres} nearer than their padding"
                if padded
                else (f"overlap by {millimetres}")
            )
        where = f"{at:.3g} of edge {edge}" if seconds is None else f"{seconds:.3f} s"
        return PathProof(False, f"{who} {what} at {where}", 0.0, stop)


def _moved(
    present: NDArray[np.float64], q: NDArray[np.float64], moving: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return configurations ``(..., nq)`` with all positions but those that move as at present."""
    result = np.empty_like(q)
    result[:] = present
    result[..., moving] = q[..., moving]
    return result
