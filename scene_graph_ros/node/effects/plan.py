"""The path that was planned last: shown, and proven again when what is around it has moved.

Imported when a path was first found. It works in a thread of its own, for those who listen.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import threading
import time
import traceback
from typing import Any

from visualization_msgs.msg import MarkerArray

from msg_adapters.poses import header_to_msg
from msg_adapters.robot_configurations import configurations_to_msg
from scene_graph_msgs.msg import PlanHolds
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.effects.frames import FrameThread
from scene_graph_ros.node.effects.plan_markers import PlanMarkers
from scene_graph_ros.node.effects.plan_proof import PathInWorld, PathProof
from scene_graph_ros.node.runtime.names import MARKERS_PLAN, PLAN_HOLDS
from scene_graph_ros.node.runtime.qos import latched_qos
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["PlanEffect"]

_RECENT = 100
"""Proofs whose times are remembered."""


class PlanEffect:
    """Publishes markers of the newest path, and whether it holds."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._markers = Outlet(host, MarkerArray, MARKERS_PLAN, latched_qos())
        self._holds = Outlet(host, PlanHolds, PLAN_HOLDS, latched_qos())
        self._frames = FrameThread("plan", host.parameter("marker_rate"), self._make)
        self._publishing = threading.Lock()
        self._is_closed = False
        self._shown = PlanMarkers(host.world_frame)
        self._path: PlannedPath | None = None
        self._world: PathInWorld | None = None
        self._proof = PathProof(False, "", 0.0, None)
        self._untold: set[Outlet] = set()
        self._failure = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._proofs = 0

    def is_heard(self) -> bool:
        """Tell whether either topic has subscribers."""
        return self._markers.is_heard() or self._holds.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens."""
        return self.is_heard()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: what takes long is done in a thread of its own."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to that thread."""
        self._frames.offer(snapshot)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take the markers back."""
        self._publish(self._markers, self._shown.none(snapshot.stamp))

    def close(self) -> None:
        """Stop being advertised."""
        self._frames.stop()
        with self._publishing:
            self._is_closed = True
            self._markers.close()
            self._holds.close()

    def failure(self) -> str:
        """Say why a path could not be looked at, "" where it could."""
        return self._failure

    def stale(self) -> str:
        """Return "": it is about a path, which does not go."""
        return ""

    def recent_seconds(self) -> list[float]:
        """Return how long the last proofs took."""
        return list(self._seconds)

    def count(self) -> int:
        """Return how often a path was proven again."""
        return self._proofs

    def counters(self) -> Mapping[str, Any]:
        """Return how often paths were proven, and messages published."""
        return {
            "proofs": self._proofs,
            "marker messages": self._markers.messages,
            "messages": self._holds.messages,
        }

    # In its own thread.

    def _make(self, snapshot: WorldSnapshot) -> None:
        path = self._host.newest_plan()
        if path is None:
            return
        try:
            self._follow(path, snapshot)
            for outlet, message in ((self._holds, self._message), (self._markers, self._marks)):
                if outlet.take_newcomers():
                    self._untold.add(outlet)
                if outlet in self._untold and outlet.is_due():
                    self._untold.discard(outlet)
                    self._publish(outlet, message(path, snapshot))
            self._failure = ""
        except Exception as error:  # noqa: BLE001 - what fails here costs nothing else
            if not self._is_closed and not self._failure:
                self._host.node.get_logger().error(
                    f"a planned path can't be looked at:\n{traceback.format_exc()}"
                )
            self._failure = f"{type(error).__name__}: {error}"

    def _follow(self, path: PlannedPath, snapshot: WorldSnapshot) -> None:
        """Prove the path again where something that matters is not where it was."""
        begin, before = time.perf_counter(), self._world
        try:
            world = PathInWorld(path, snapshot)
        except UnknownIdError as error:
            if self._path is not path or before is not None:
                self._take(path, None, PathProof(False, str(error), 0.0, None))
            return
        if before is None or not world.is_as(before):
            self._take(path, world, world.prove())
            self._seconds.append(time.perf_counter() - begin)
            self._proofs += 1

    def _take(self, path: PlannedPath, world: PathInWorld | None, proof: PathProof) -> None:
        """Tell of a proof; markers are made again where they would say something else."""
        if path is not self._path or _verdict(proof) != _verdict(self._proof):
            self._untold.add(self._markers)
        self._untold.add(self._holds)
        self._path, self._world, self._proof = path, world, proof

    def _message(self, path: PlannedPath, snapshot: WorldSnapshot) -> PlanHolds:
        proof, world = self._proof, self._world
        about = snapshot if world is None else world.snapshot
        message = PlanHolds(
            header=header_to_msg(about.stamp, self._host.world_frame),
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

    def _marks(self, path: PlannedPath, snapshot: WorldSnapshot) -> MarkerArray:
        if self._world is None:
            return self._shown.none(snapshot.stamp)
        return self._shown.of(self._world, self._proof)

    def _publish(self, outlet: Outlet, message: Any) -> None:
        with self._publishing:
            if not self._is_closed:
                outlet.publish(message)


def _verdict(proof: PathProof) -> tuple[Any, ...]:
    """Return what the markers of a path show of a proof."""
    stop = proof.stop
    return proof.holds, None if stop is None else (stop.edge, stop.pair)
