"""The path that was planned last: shown, and proven again when its surroundings have moved.

Imported when a path was first found. It works in a thread of its own, for subscribers.
"""

from __future__ import annotations

import time
from typing import Any

from visualization_msgs.msg import MarkerArray

from msg_adapters.poses import header_to_msg
from msg_adapters.robot_configurations import configurations_to_msg
from scene_graph_msgs.msg import PlanHolds
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.following import FollowingEffect
from scene_graph_ros.node.effects.plan_markers import PlanMarkers
from scene_graph_ros.node.effects.plan_proof import PathInWorld, PathProof
from scene_graph_ros.node.runtime.names import MARKERS_PLAN, PLAN_HOLDS
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.source_stamps import seen_until
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["PlanEffect"]

_Followed = tuple[PlannedPath, WorldSnapshot]


class PlanEffect(FollowingEffect[_Followed]):
    """Publishes markers of the newest path, and whether it holds."""

    what, counted = "a planned path", "proofs"

    def __init__(self, host: Host) -> None:
        super().__init__(host, "plan", MARKERS_PLAN, PlanHolds, PLAN_HOLDS)
        self._shown = PlanMarkers(host.world_frame)
        self._path: PlannedPath | None = None
        self._world: PathInWorld | None = None
        self._proof = PathProof(False, "", 0.0, None)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take the markers back."""
        self._publish(self._markers, self._shown.none(snapshot.stamp))

    def stale(self) -> str:
        """Return "": it is about a path, which does not go."""
        return ""

    # In its own thread.

    def _follow(self, snapshot: WorldSnapshot) -> _Followed | None:
        """Prove the path again where something that matters is not where it was."""
        path = self._host.newest_plan()
        if path is None:
            return None
        begin, before = time.perf_counter(), self._world
        try:
            world = PathInWorld(path, snapshot)
        except UnknownIdError as error:
            if self._path is not path or before is not None:
                self._take(path, None, PathProof(False, str(error), 0.0, None))
            return path, snapshot
        if before is None or not world.is_as(before):
            self._take(path, world, world.prove())
            self._note_look(begin)
        return path, snapshot

    def _take(self, path: PlannedPath, world: PathInWorld | None, proof: PathProof) -> None:
        """Tell of a proof; markers are made again where they would say something else."""
        if path is not self._path or _verdict(proof) != _verdict(self._proof):
            self._untold.add(self._markers)
        self._untold.add(self._told)
        self._path, self._world, self._proof = path, world, proof

    def _message(self, followed: _Followed) -> PlanHolds:
        path, snapshot = followed
        proof, world = self._proof, self._world
        about = snapshot if world is None else world.snapshot
        seen = seen_until(about.images, about.records, about.sensing)
        stamp = about.stamp if seen is None else min(seen, about.stamp)
        message = PlanHolds(
            header=header_to_msg(stamp, self._host.world_frame),
            scene_version=about.scene_version,
            holds=proof.holds,
            reason=proof.reason,
            least_clearance=proof.least_clearance,
        )
        message.goal_id.uuid = list(path.goal_id)
        stop = proof.stop
        if stop is not None and world is not None:
            names = about.names
            message.edge, message.at, message.depth = stop.edge, stop.at, stop.depth
            message.seconds = stop.seconds or 0.0
            message.geometry_a, message.geometry_b = map(names.geometry_name, stop.pair)
            message.configuration = configurations_to_msg(
                world.robots.positions, stop.configuration[None], path.moving
            )
        return message

    def _marks(self, followed: _Followed) -> MarkerArray:
        if self._world is None:
            return self._shown.none(followed[1].stamp)
        return self._shown.of(self._world, self._proof)


def _verdict(proof: PathProof) -> tuple[Any, ...]:
    """Return the parts of a proof that markers of a path show."""
    stop = proof.stop
    return proof.holds, None if stop is None else (stop.edge, stop.pair)
