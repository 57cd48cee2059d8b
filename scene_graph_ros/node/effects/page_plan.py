"""A motion that was planned for a page: its way and clearance, moments to play, and its execution.

Imported with the first link that a page holds.
"""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError, UnavailableError
from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.page_ghost import moved_geometries
from scene_graph_ros.node.effects.plan_proof import PathInWorld
from scene_graph_ros.node.effects.plan_way import FAR, way_of
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.reported_joints import require_reported
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.blocks import plan_block

if TYPE_CHECKING:
    from trajectory_msgs.msg import JointTrajectory

__all__ = ["NO_PLAN", "PagePlan"]

NO_PLAN = plan_block({"plan": 0})

_NEAR = 0.01
"""rad or m: a motion begins where the robot is, within this, as MoveIt's
``allowed_start_tolerance``."""

_MOMENTS, _FEWEST, _MOST_POSES = 121, 21, 20_000
"""Moments of a motion that a page plays: fewer where there are many bodies."""


class PagePlan:
    """One motion, as an answer of the action has it."""

    def __init__(
        self,
        number: int,
        result: Any,
        path: PlannedPath,
        snapshot: WorldSnapshot,
        link: str,
        replaced: JointTrajectory | None = None,
        within: float = 0.0,
    ) -> None:
        """Prepare to show the way of ``link``. Raises UnknownIdError as `PathInWorld`.

        ``replaced`` is the motion that it goes on from, if it is executed ``within`` so long (s).
        """
        self.number, self.trajectory, self._path = number, result.trajectory, path
        self.replaced, self.replaces_from = replaced, int(result.replaces_from)
        world = PathInWorld(path, snapshot)
        way = way_of(world)
        points = world.robots.tree.link_poses(way.configurations, [link])[:, 0, :3, 3]
        times, q = self._moments(world)
        ids, X_WGs = moved_geometries(world.robots, snapshot, q, path.moving)
        if len(ids) * len(q) > _MOST_POSES:
            step = -(-(len(q) - 1) // max(_MOST_POSES // len(ids), _FEWEST))
            rows = np.append(np.arange(0, len(q) - 1, step), len(q) - 1)
            times, X_WGs = times[rows], X_WGs[rows]
        self.block = plan_block(
            {
                "plan": number,
                "duration": float(times[-1]),
                "within": within,
                "times": times.tolist(),
                "way": points.tolist(),
                "proven": way.proven.tolist(),
                "far": FAR,
                "least_clearance": float(result.trajectory_clearance),
                "points": len(result.trajectory.points),
                "seconds": float(result.seconds),
            },
            ids,
            X_WGs,
        )

    def _moments(self, world: PathInWorld) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times ``(k,)`` s from its beginning, and configurations ``(k, nq)``."""
        _, points = joint_trajectory_from_msg(self.trajectory)
        curve = points.trajectory()
        times = np.linspace(curve.start_time, curve.end_time, _MOMENTS)
        q = np.repeat(world.configurations[:1], _MOMENTS, axis=0)
        q[:, self._path.moving] = curve.value(times)
        return times - times[0], q

    def require_executable(
        self, snapshot: WorldSnapshot, host: Host, group: str, now: int
    ) -> None:
        """Raise where it does not begin where the robot is, or is not proven free any more.

        Raises StaleError where nobody has reported that, MessageError where it is elsewhere,
        UnavailableError where something is in the way, UnknownIdError for other robots.
        """
        world = PathInWorld(self._path, snapshot)
        request = PlanPath.Goal(group=group)
        require_reported(request, world.robots, snapshot, host.parameter, now)
        present = world.robots.present(snapshot.positions)
        away = np.abs(present - self._path.configurations[0])[self._path.moving]
        worst = int(np.argmax(away))
        if away[worst] > _NEAR:
            name = self._path.position_names[self._path.moving[worst]]
            raise MessageError(
                f"the motion begins with {name} {away[worst]:.3g} from where it is by now, and"
                f" {_NEAR:g} is the most: plan again"
            )
        self.require_free(snapshot)

    def require_free(self, snapshot: WorldSnapshot) -> None:
        """Raise UnavailableError where it is not proven free in the world as it is by now."""
        proof = PathInWorld(self._path, snapshot).prove()
        if not proof.holds:
            raise UnavailableError(f"the motion is not free any more: {proof.reason}")
