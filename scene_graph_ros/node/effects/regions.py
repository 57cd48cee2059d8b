"""The regions that the node keeps: shown, and looked at again when what is around them has moved.

Imported when a region is first kept. It works in a thread of its own, for those who listen.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import threading
import time
import traceback
from typing import Any

from visualization_msgs.msg import MarkerArray

from msg_adapters.region_markers import region_deletions_to_msg, region_markers_to_msg
from msg_adapters.regions import region_array_to_msg
from scene_graph_msgs.msg import RegionArray
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.effects.frames import FrameThread
from scene_graph_ros.node.runtime.names import MARKERS_REGIONS, REGIONS
from scene_graph_ros.node.runtime.qos import latched_qos
from scene_graph_ros.node.world.kept_regions import FollowedRegions
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["RegionsEffect"]

_RECENT = 100
"""Looks at regions whose times are remembered."""

_GONE = 100
"""Regions whose markers are taken back again with each message: one may replace another that a
reader has not got yet."""


class RegionsEffect:
    """Publishes all regions, and their markers."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._markers = Outlet(host, MarkerArray, MARKERS_REGIONS, latched_qos())
        self._told = Outlet(host, RegionArray, REGIONS, latched_qos())
        self._frames = FrameThread("regions", host.parameter("marker_rate"), self._make)
        self._publishing = threading.Lock()
        self._is_closed = False
        self._shown: set[str] = set()
        self._gone: deque[str] = deque(maxlen=_GONE)
        self._naming = threading.Lock()
        self._revision = -1
        self._untold: set[Outlet] = set()
        self._failure = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._looks = 0

    def is_heard(self) -> bool:
        """Tell whether either topic has subscribers."""
        return self._markers.is_heard() or self._told.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens."""
        return self.is_heard()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: what takes long is done in a thread of its own."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to that thread."""
        self._frames.offer(snapshot)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take the markers back, and say that there are no regions."""
        gone = self._deletions(self._names_gone(set()), snapshot.stamp)
        self._publish(self._markers, MarkerArray(markers=gone))
        self._publish(self._told, self._message(FollowedRegions(snapshot, {}, 0)))

    def close(self) -> None:
        """Stop being advertised."""
        self._frames.stop()
        with self._publishing:
            self._is_closed = True
            self._markers.close()
            self._told.close()

    def failure(self) -> str:
        """Say why regions could not be looked at, "" where they could."""
        return self._failure

    def stale(self) -> str:
        """Say which regions are not free, or that this is not known."""
        regions = self._host.kept_regions()
        return "" if regions is None else str(regions.stale())

    def recent_seconds(self) -> list[float]:
        """Return how long the last looks took."""
        return list(self._seconds)

    def count(self) -> int:
        """Return how often something was other than before."""
        return self._looks

    def counters(self) -> Mapping[str, Any]:
        """Return how often regions were other than before, and messages published."""
        return {
            "changes": self._looks,
            "marker messages": self._markers.messages,
            "messages": self._told.messages,
        }

    # In its own thread.

    def _make(self, snapshot: WorldSnapshot) -> None:
        regions = self._host.kept_regions()
        if regions is None:
            return
        try:
            begin = time.perf_counter()
            followed = regions.follow(snapshot)
            if followed.revision != self._revision:
                self._revision = followed.revision
                self._untold |= {self._markers, self._told}
                self._seconds.append(time.perf_counter() - begin)
                self._looks += 1
            for outlet, message in ((self._told, self._message), (self._markers, self._marks)):
                if outlet.take_newcomers():
                    self._untold.add(outlet)
                if outlet in self._untold and outlet.is_due():
                    self._untold.discard(outlet)
                    self._publish(outlet, message(followed))
            self._failure = ""
        except Exception as error:  # noqa: BLE001 - what fails here costs nothing else
            if not self._is_closed and not self._failure:
                self._host.node.get_logger().error(
                    f"regions can't be looked at:\n{traceback.format_exc()}"
                )
            self._failure = f"{type(error).__name__}: {error}"

    def _message(self, followed: FollowedRegions) -> RegionArray:
        snapshot = followed.snapshot
        return region_array_to_msg(
            {name: (kept.region, cuts) for name, (kept, cuts) in followed.regions.items()},
            snapshot.names,
            stamp_ns=snapshot.stamp,
            frame_id=self._host.world_frame,
            scene_version=snapshot.scene_version,
        )

    def _marks(self, followed: FollowedRegions) -> MarkerArray:
        snapshot, frame = followed.snapshot, self._host.world_frame
        markers = self._deletions(self._names_gone({*followed.regions}), snapshot.stamp)
        for name, (kept, cuts) in sorted(followed.regions.items()):
            who = [snapshot.names.geometry_path(cut.geometry_id) for cut in cuts]
            more = f" and {len(who) - 1} more" if len(who) > 1 else ""
            markers += region_markers_to_msg(
                name,
                kept.form,
                f"cut by {who[0]}{more}" if who else "",
                [cut.point for cut in cuts],
                stamp_ns=snapshot.stamp,
                frame_id=frame,
            )
        return MarkerArray(markers=markers)

    def _names_gone(self, shown: set[str]) -> set[str]:
        """Note which regions are shown from now on, and return some that are not any more."""
        with self._naming:
            self._gone.extend(sorted(self._shown - shown - {*self._gone}))
            self._shown = shown
            return {*self._gone} - shown

    def _deletions(self, names: set[str], stamp: int) -> list[Any]:
        frame = self._host.world_frame
        return [
            marker
            for name in sorted(names)
            for marker in region_deletions_to_msg(name, stamp_ns=stamp, frame_id=frame)
        ]

    def _publish(self, outlet: Outlet, message: Any) -> None:
        with self._publishing:
            if not self._is_closed:
                outlet.publish(message)
