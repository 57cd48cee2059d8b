"""Obstacles that move, as kernels read them: the bodies on their frames, and how these go on."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.velocities.errors import SafeVelocityError
from scene_graph_ros.planning.velocities.moving_kernels import MovingBodies

__all__ = ["MovingObstacles", "ObstacleFrames", "ObstacleVelocities"]

ObstacleVelocities = Mapping[FrameId, ArrayLike | float]
"""Of each frame the velocity ``(6,)``, angular and linear in W, or a bound of the speed (m/s)."""


class MovingObstacles(NamedTuple):
    """Bodies that move, without the pairs that are looked at."""

    table: MovingBodies
    row_of_body: NDArray[np.int64]
    """``(b,)``: of the plan's bodies the row in the table, -1 where it stands still."""
    fastest: float
    """m/s: how fast any of their points is."""


class _Bodies(NamedTuple):
    """The bodies on some frames."""

    frames: tuple[FrameId, ...]
    rows: NDArray[np.int64]
    frame_of: NDArray[np.int64]
    X_WG: NDArray[np.float64]
    origins: NDArray[np.float64]
    reaches: NDArray[np.float64]
    """``(m,)`` m: the largest distance of a body's points from its frame's origin."""
    row_of_body: NDArray[np.int64]


_NO_TWIST = np.zeros(6)


class ObstacleFrames:
    """The frames of a plan's bodies that are around the robots."""

    def __init__(self, plan: CheckerPlan, snapshot: Snapshot) -> None:
        """Find the frames between each such body and the world."""
        self._plan, self._snapshot = plan, snapshot
        inspector = snapshot.inspector
        self._inspector, world = inspector, inspector.world_frame_id()
        self._robots = len(plan.bodies.joints)
        self._chains: list[list[int]] = []
        for id_G in plan.geometry_ids[self._robots :]:
            frame, chain = inspector.get_frame_id(id_G), []
            while frame != world:
                chain.append(int(frame))
                frame = inspector.get_parent_frame(frame)
            self._chains.append(chain)
        self._bodies: _Bodies | None = None
        self._known = {each for chain in self._chains for each in chain}

    def moving(self, obstacles: ObstacleVelocities) -> MovingObstacles:
        """Return the bodies that move. Raises SafeVelocityError naming a frame or velocity.

        A body goes with the nearest of its frames that has a velocity.
        """
        frames = tuple(obstacles)
        if self._bodies is None or self._bodies.frames != frames:
            self._bodies = self._bodies_on(frames)
        known = self._bodies
        given = [_velocity(each, value, self._inspector) for each, value in obstacles.items()]
        every, limits = (np.array(column) for column in zip(*given, strict=True))
        twists = every[known.frame_of].reshape(-1, 6)
        bounds = limits[known.frame_of].reshape(-1)
        turning = np.sqrt((twists[:, :3] ** 2).sum(axis=1))
        # A half space that turns is infinitely fast, one that does not is as any other.
        swings = np.zeros(len(turning))
        turns = turning > 0.0
        swings[turns] = turning[turns] * known.reaches[turns]
        fastest = np.sqrt((twists[:, 3:] ** 2).sum(axis=1)) + swings
        table = MovingBodies(
            known.rows,
            known.X_WG,
            known.origins,
            twists,
            fastest,
            bounds,
            np.empty(0, dtype=np.int64),
        )
        return MovingObstacles(
            table, known.row_of_body, float((fastest + bounds).max(initial=0.0))
        )

    def _bodies_on(self, frames: tuple[FrameId, ...]) -> _Bodies:
        """Return the bodies on frames. Raises SafeVelocityError for one that has none."""
        numbers = {}
        for i, frame in enumerate(frames):
            number = _value(frame)
            if number not in self._known:
                raise SafeVelocityError(self._unknown(frame))
            numbers[number] = i
        bodies = self._plan.bodies
        found = [
            (self._robots + row, next(numbers[each] for each in chain if each in numbers))
            for row, chain in enumerate(self._chains)
            if any(each in numbers for each in chain)
        ]
        rows = np.array([body for body, _ in found], dtype=np.int64)
        X_WG = bodies.X_WG[rows - self._robots].reshape(-1, 3, 4)
        places = [self._snapshot.pose_in_world(frame)[:3, 3] for frame in frames]
        frame_of = np.array([i for _, i in found], dtype=np.int64)
        origins = np.array(places)[frame_of].reshape(-1, 3)
        centers = np.einsum("nij,nj->ni", X_WG[:, :, :3], bodies.centers[rows]) + X_WG[:, :, 3]
        row_of_body = np.full(len(bodies.rows), -1)
        row_of_body[rows] = np.arange(len(rows))
        reaches = np.linalg.norm(centers - origins, axis=1) + bodies.radii[rows]
        return _Bodies(frames, rows, frame_of, X_WG, origins, reaches, row_of_body)

    def _unknown(self, frame: object) -> str:
        ids = {int(each): each for each in self._inspector.get_all_frame_ids()}
        found = ids.get(_value(frame))
        if found is None:
            return f"obstacles: {quoted(frame)} is no frame of the scene"
        path = self._inspector.get_path(found)
        return f"obstacles: no geometry that is checked, and around the robots, is on {path!r}"


def _value(frame: object) -> int:
    """Return the value of a frame's id, -1 for anything else."""
    return int(frame) if isinstance(frame, FrameId) else -1


def _velocity(
    frame: FrameId, value: ArrayLike | float, inspector: SceneGraphInspector
) -> tuple[NDArray[np.float64], float]:
    """Return a twist ``(6,)`` and a bound (m/s), one of which is zero."""
    if type(value) is float and 0.0 <= value < math.inf:
        return _NO_TWIST, value
    name = inspector.get_path(frame)
    rule = f"obstacles: {name!r} must have a velocity (6,) or a bound of its speed (m/s)"
    array = real_array(value, rule, SafeVelocityError)
    if array.shape == (6,) and np.isfinite(array).all():
        return array, 0.0
    if array.shape == () and 0.0 <= float(array) < math.inf:
        return _NO_TWIST, float(array)
    raise SafeVelocityError(f"{rule}, not {quoted(value)}")
