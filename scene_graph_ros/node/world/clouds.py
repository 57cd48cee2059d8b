"""Clouds of a source, as far as its messages of points are concerned. No rclpy here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.node.world.sensed import ids_by_name, NotFilledError, SensedGeometry

if TYPE_CHECKING:
    from scene_graph_ros.node.world.sensor_state import Looked
    from scene_graph_ros.sensing import SeenPoints

__all__ = ["SourceClouds", "clouds_by_source"]


class _Sensed(NamedTuple):
    """Points ``(n, 3)`` of a geometry's frame, m; radii ``(n,)``, m, or those of the shape."""

    p_GPs: NDArray[np.float64]
    radii: NDArray[np.float64] | None = None


def _nothing() -> SeenPoints:
    """Return no points; imported where a source has a cloud."""
    from scene_graph_ros.sensing import SeenPoints

    return SeenPoints.none()


@dataclass
class SourceClouds(SensedGeometry):
    """The clouds of one source; a context has their points.

    ``fresh`` has points that no context has yet, ``points`` are those that all sensors have seen.
    """

    noun: ClassVar[str] = "cloud"

    fresh: dict[GeometryId, _Sensed] = field(default_factory=dict)
    points: SeenPoints = field(default_factory=_nothing)

    def geometry(self) -> GeometryId:
        """Return the geometry that messages are about. Raises NotFilledError."""
        found = super().geometry()
        if self.inspector.get_shape(found).has_radii:
            raise NotFilledError(
                f"cloud {quoted(self.inspector.get_name(found))} has a radius for each point,"
                " which no message has; register it with one for all"
            )
        return found

    def seen(self) -> SeenPoints:
        """Return the points that all sensors have seen."""
        return self.points

    def error(self, geometry_id: GeometryId) -> float:
        """Return the radius of the geometry's balls, m."""
        return float(self.inspector.get_shape(geometry_id).radius)

    def take(self, looked: Looked, geometry_id: GeometryId, X_WG: NDArray[np.float64]) -> None:
        """Take the points that there are after a message; the geometry was at ``X_WG`` then."""
        self.points = looked.seen
        self._see(geometry_id, X_WG)

    def told(self, looked: Looked, message: str) -> dict[str, int]:
        """Return the counts of a message for diagnostics, by name."""
        counts = looked.counts
        return {
            "points": len(self.points),
            f"points of the newest {message}": counts.new,
            "points cleared by it": counts.cleared,
            "points seen again in it": counts.seen_again,
        }

    def _see(self, geometry_id: GeometryId, X_WG: NDArray[np.float64]) -> None:
        seen = self.points
        p_GPs = seen.p_WPs if np.array_equal(X_WG, np.eye(4)) else moved(seen.p_WPs, inverse(X_WG))
        radii = seen.radii if self._has_images else None
        is_near = (np.abs(p_GPs) <= MAX_COORDINATE).all(axis=1)
        if not is_near.all():
            p_GPs, radii = p_GPs[is_near], None if radii is None else radii[is_near]
        self.fresh[geometry_id] = _Sensed(p_GPs, radii)

    @property
    def _has_images(self) -> bool:
        """Whether some sensor sends images, the points of which have radii of their own."""
        return any(state.settings.has_radii for state in self.sensors.values())

    def expire(self, now: int) -> bool:
        """Forget points that were seen too long ago; tell whether there were any."""
        before = self.points
        for state in self.sensors.values():
            if state.settings.expires and now > 0:
                since = now - int(state.settings.expires * 1e9)
                self.points = self.points.since(since, state.number)
        if self.points is before:
            return False
        cloud = self.geometry()
        self._see(cloud, self.inspector.get_pose_in_frame(cloud))
        return True

    def bring(self, context: Context) -> None:
        """Give a context the fresh points."""
        given = {
            geometry_id: sensed.p_GPs if sensed.radii is None else tuple(sensed)
            for geometry_id, sensed in self.fresh.items()
        }
        context.set_points(self.source, given)
        self.heard.update(given)
        self.fresh.clear()

    def take_over(self, old: SensedGeometry, before: Context, context: Context) -> None:
        """Take the state of the same clouds in the scene before, and give a context its points."""
        if not isinstance(old, SourceClouds):
            return
        there = {geometry_id for found in self.ids.values() for geometry_id in found}
        self.heard = old.heard & there
        points = {g: before.snapshot.point_set(g) for g in self.heard}
        context.set_points(self.source, points)
        numbers = np.full(1 + max((s.number for s in old.sensors.values()), default=-1), -1)
        for name, state in old.sensors.items():
            if name in self.sensors:
                numbers[state.number] = self.sensors[name].number
                self.sensors[name].take_over(state)
        self.points = old.points.numbered(numbers)
        if len(self.points) < len(old.points) and self.heard:
            (cloud,) = self.heard
            self._see(cloud, self.inspector.get_pose_in_frame(cloud))
            self.bring(context)

    def forget(self, after: int) -> None:
        """Forget stamps later than that, and the present look; the points hold."""
        super().forget(after)
        self.points = self.points.stamped_at_most(after)


def clouds_by_source(
    names: SceneNames,
    inspector: Any,
    sources: Mapping[str, tuple[SourceId, str]],
    world_frame: str,
) -> dict[str, SourceClouds]:
    """Return the clouds of all sources that have some; no message was heard of them yet.

    ``sources`` maps names to ids, and to the name of the cloud that messages are about.
    """
    by_owner: dict[SourceId, list[GeometryId]] = defaultdict(list)
    for geometry_id in inspector.get_all_cloud_ids():
        by_owner[inspector.get_owning_source_id(geometry_id)].append(geometry_id)
    return {
        name: SourceClouds(
            source,
            name,
            wanted,
            ids_by_name(by_owner[source], inspector),
            names,
            inspector,
            world_frame,
        )
        for name, (source, wanted) in sources.items()
        if source in by_owner
    }
