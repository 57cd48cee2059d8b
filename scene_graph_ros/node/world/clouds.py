"""Clouds of a source, as far as its messages of points are concerned. No rclpy here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.node.world.intake import UNSTAMPED

if TYPE_CHECKING:
    from scene_graph_ros.node.world.sensor_state import SensorState
    from scene_graph_ros.sensing import SeenPoints

__all__ = ["NoCloudError", "SourceClouds", "clouds_by_source"]


class NoCloudError(UnknownIdError):
    """Points of a source of which nobody knows whose they are."""


class _Sensed(NamedTuple):
    """Points ``(n, 3)`` of a geometry's frame, m; radii ``(n,)``, m, or those of the shape."""

    p_GPs: NDArray[np.float64]
    radii: NDArray[np.float64] | None = None


def _nothing() -> SeenPoints:
    """Return no points; imported where a source has a cloud."""
    from scene_graph_ros.sensing import SeenPoints

    return SeenPoints.none()


@dataclass
class SourceClouds:
    """The clouds of one source; a context has their points.

    ``ids`` are the geometries by name; ``heard`` are those whose points a message brought,
    ``fresh`` has points that no context has yet. ``sensors`` are the states of those that fill
    the cloud by the names of their sources, ``seen`` the points that they have seen.
    """

    source: SourceId
    source_name: str
    wanted: str
    """The name of the geometry that messages are about, "" for the only one."""
    ids: Mapping[str, list[GeometryId]]
    names: SceneNames
    inspector: Any
    world_frame: str
    heard: set[GeometryId] = field(default_factory=set)
    fresh: dict[GeometryId, _Sensed] = field(default_factory=dict)
    sensors: dict[str, SensorState] = field(default_factory=dict)
    seen: SeenPoints = field(default_factory=_nothing)
    look: object | None = None
    """The one at a message that has no result yet: the next one begins with its points."""

    def cloud(self) -> GeometryId:
        """Return the geometry that messages are about. Raises NoCloudError."""
        named = [name for name in self.ids if self.wanted in ("", name)]
        found = [geometry_id for name in named for geometry_id in self.ids[name]]
        if len(found) != 1:
            raise NoCloudError(self._no_choice(len(found)))
        if self.inspector.get_shape(found[0]).has_radii:
            raise NoCloudError(
                f"cloud {quoted(named[0])} has a radius for each point, which no message has;"
                " register it with one for all"
            )
        return found[0]

    def _no_choice(self, count: int) -> str:
        """Say why no cloud, or none of several, is meant."""
        if not count:
            return f"the source has no cloud {quoted(self.wanted)}, but {quoted(sorted(self.ids))}"
        if self.wanted:
            return f"{count} clouds of the source are called {quoted(self.wanted)}"
        return (
            f"the source has {count} clouds, {quoted(sorted(self.ids))}: name the one that it"
            " sends in the scene file, sources: points: geometry; or have a source for each"
        )

    def frame(self, name: str, geometry_id: GeometryId) -> FrameId:
        """Return the frame of the scene that a message calls ``name``.

        That of the cloud comes first, then those of its source, then others. Raises UnknownIdError
        for a name that is none, NameConflictError where several sources have one.
        """
        inspector, world = self.inspector, self.inspector.world_frame_id()
        own: FrameId = inspector.get_frame_id(geometry_id)
        if name == self.world_frame:
            return world
        if own != world and inspector.get_name(own) == name:
            return own
        return self.frame_named(name)

    def frame_named(self, name: str) -> FrameId:
        """Return the frame of the scene that has a name or path; raises as `frame` does."""
        world: FrameId = self.inspector.world_frame_id()
        if name == self.world_frame:
            return world
        try:
            found = self._named(name)
        except NameConflictError as error:
            raise NameConflictError(f"{error}; send the points in one by its path") from error
        if found is None or found == world:
            raise UnknownIdError(
                f"the points are in {quoted(name)}, which is no frame of the scene: register it,"
                f" or send them in one that is, or in {quoted(self.world_frame)}"
            )
        return found

    def _named(self, name: str) -> FrameId | None:
        for source in (self.source_name, None):
            try:
                return self.names.frame_id(name, source)
            except UnknownIdError:
                continue
        return None

    def see(self, geometry_id: GeometryId, X_WG: NDArray[np.float64]) -> None:
        """Take the points that sensors have seen by now; the geometry was at ``X_WG`` then."""
        seen = self.seen
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
        before = self.seen
        for state in self.sensors.values():
            if state.settings.expires and now > 0:
                since = now - int(state.settings.expires * 1e9)
                self.seen = self.seen.since(since, state.number)
        if self.seen is before:
            return False
        cloud = self.cloud()
        self.see(cloud, self.inspector.get_pose_in_frame(cloud))
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

    def take_over(self, old: SourceClouds, before: Context, context: Context) -> None:
        """Take the state of the same clouds in the scene before, and give a context its points."""
        there = {geometry_id for found in self.ids.values() for geometry_id in found}
        self.heard = old.heard & there
        points = {g: before.snapshot.point_set(g) for g in self.heard}
        context.set_points(self.source, points)
        numbers = np.full(1 + max((s.number for s in old.sensors.values()), default=-1), -1)
        for name, state in old.sensors.items():
            if name in self.sensors:
                numbers[state.number] = self.sensors[name].number
                self.sensors[name].take_over(state)
        self.seen = old.seen.numbered(numbers)
        if len(self.seen) < len(old.seen) and self.heard:
            (cloud,) = self.heard
            self.see(cloud, self.inspector.get_pose_in_frame(cloud))
            self.bring(context)

    def stamp(self) -> int:
        """Return the newest stamp of points, nanoseconds."""
        return max((state.stamp for state in self.sensors.values()), default=UNSTAMPED)

    def forget(self, after: int) -> None:
        """Forget stamps later than that, and the present look; the points hold."""
        self.look = None
        self.seen = self.seen.stamped_at_most(after)
        for state in self.sensors.values():
            state.forget(after)


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
            _by_name(by_owner[source], inspector),
            names,
            inspector,
            world_frame,
        )
        for name, (source, wanted) in sources.items()
        if source in by_owner
    }


def _by_name(ids: Iterable[GeometryId], inspector: Any) -> dict[str, list[GeometryId]]:
    by_name: dict[str, list[GeometryId]] = defaultdict(list)
    for geometry_id in ids:
        by_name[inspector.get_name(geometry_id)].append(geometry_id)
    return dict(by_name)
