"""The regions that the node keeps: shown, and checked again when their surroundings have moved.

Imported when a region is first kept. It works in a thread of its own, for subscribers.
"""

from __future__ import annotations

from collections import deque
import threading
import time
from typing import Any

from visualization_msgs.msg import MarkerArray

from msg_adapters.region_markers import region_deletions_to_msg, region_markers_to_msg
from msg_adapters.regions import region_array_to_msg
from scene_graph_msgs.msg import RegionArray
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.following import FollowingEffect
from scene_graph_ros.node.runtime.names import MARKERS_REGIONS, REGIONS
from scene_graph_ros.node.world.kept_regions import FollowedRegions
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["RegionsEffect"]

_GONE = 100
"""Regions whose markers are taken back again with each message: one may replace another that a
reader has not got yet."""


class RegionsEffect(FollowingEffect[FollowedRegions]):
    """Publishes all regions, and their markers."""

    what, counted = "regions", "changes"

    def __init__(self, host: Host) -> None:
        super().__init__(host, "regions", MARKERS_REGIONS, RegionArray, REGIONS)
        self._shown: set[str] = set()
        self._gone: deque[str] = deque(maxlen=_GONE)
        self._naming = threading.Lock()
        self._revision = -1

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take the markers back, and say that there are no regions."""
        gone = self._deletions(self._names_gone(set()), snapshot.stamp)
        self._publish(self._markers, MarkerArray(markers=gone))
        self._publish(self._told, self._message(FollowedRegions(snapshot, {}, 0)))

    def stale(self) -> str:
        """Name the regions that are not free, or say that this is not known."""
        regions = self._host.kept_regions()
        return "" if regions is None else str(regions.stale())

    # In its own thread.

    def _follow(self, snapshot: WorldSnapshot) -> FollowedRegions | None:
        regions = self._host.kept_regions()
        if regions is None:
            return None
        begin = time.perf_counter()
        followed = regions.follow(snapshot)
        if followed.revision != self._revision:
            self._revision = followed.revision
            self._untold |= {self._markers, self._told}
            self._note_look(begin)
        return followed

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
