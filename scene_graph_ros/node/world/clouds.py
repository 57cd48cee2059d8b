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
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.node.world.intake import UNSTAMPED

if TYPE_CHECKING:
    from scene_graph_ros.node.world.depth_state import DepthState

__all__ = ["NoCloudError", "SourceClouds", "clouds_by_source"]


class NoCloudError(UnknownIdError):
    """Points of a source of which nobody knows whose they are."""


class _Sensed(NamedTuple):
    """Points ``(n, 3)`` in a frame of the scene, m; radii ``(n,)``, m, or those of the shape."""

    points: NDArray[np.float64]
    frame: FrameId
    radii: NDArray[np.float64] | None = None


@dataclass
class SourceClouds:
    """The clouds of one source; a context has their points.

    ``ids`` are the geometries by name, ``stamps`` in nanoseconds; ``heard`` are those whose points
    a message brought, ``fresh`` has points that no context has yet; ``images`` is the state of a
    source that sends images of depth.
    """

    source: SourceId
    source_name: str
    wanted: str
    """The name of the geometry that messages are about, "" for the only one."""
    ids: Mapping[str, list[GeometryId]]
    names: SceneNames
    inspector: Any
    world_frame: str
    stamps: dict[GeometryId, int] = field(default_factory=dict)
    heard: set[GeometryId] = field(default_factory=set)
    fresh: dict[GeometryId, _Sensed] = field(default_factory=dict)
    images: DepthState | None = None

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

    def put(
        self, geometry_id: GeometryId, points: NDArray[np.float64], frame: FrameId, stamp: int
    ) -> None:
        """Take points ``(n, 3)`` in a frame."""
        self.fresh[geometry_id] = _Sensed(points, frame)
        self.stamps[geometry_id] = stamp

    def see(self, geometry_id: GeometryId, stamp: int) -> None:
        """Take the points that images have seen by now."""
        assert self.images is not None
        self._take_seen(geometry_id)
        self.stamps[geometry_id] = stamp

    def _take_seen(self, geometry_id: GeometryId) -> None:
        assert self.images is not None
        seen, world = self.images.seen, self.inspector.world_frame_id()
        self.fresh[geometry_id] = _Sensed(seen.p_WPs, world, seen.radii)

    def expire(self, now: int) -> bool:
        """Forget points of images that were seen too long ago; tell whether there were any."""
        if self.images is None or not self.images.expire(now):
            return False
        self._take_seen(self.cloud())
        return True

    def bring(self, context: Context) -> None:
        """Give a context the fresh points; those in other frames are where these are in it now."""
        snapshot = context.snapshot
        given = {
            geometry_id: self._given(geometry_id, sensed, snapshot)
            for geometry_id, sensed in self.fresh.items()
        }
        context.set_points(self.source, given)
        self.heard.update(given)
        self.fresh.clear()

    def _given(
        self, geometry_id: GeometryId, sensed: _Sensed, snapshot: Snapshot
    ) -> NDArray[np.float64] | tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points, or points and radii, in their geometry's frame."""
        p_GPs = self._in_geometry(geometry_id, sensed.points, sensed.frame, snapshot)
        is_near = (np.abs(p_GPs) <= MAX_COORDINATE).all(axis=1)
        if not is_near.all():
            p_GPs = p_GPs[is_near]
        if sensed.radii is None:
            return p_GPs
        return p_GPs, sensed.radii if is_near.all() else sensed.radii[is_near]

    def _in_geometry(
        self,
        geometry_id: GeometryId,
        points: NDArray[np.float64],
        frame: FrameId,
        snapshot: Snapshot,
    ) -> NDArray[np.float64]:
        X_FG = self.inspector.get_pose_in_frame(geometry_id)
        X_GF = inverse(X_FG)
        if frame != self.inspector.get_frame_id(geometry_id):
            X_WG, X_WF = snapshot.pose_in_world(geometry_id), snapshot.pose_in_world(frame)
            X_GF = compose(inverse(X_WG), X_WF)
        if np.array_equal(X_GF, np.eye(4)):
            return points
        return moved(points, X_GF)

    def take_over(self, old: SourceClouds, before: Context, context: Context) -> None:
        """Take the state of the same clouds in the scene before, and give a context its points."""
        there = {geometry_id for found in self.ids.values() for geometry_id in found}
        self.heard = old.heard & there
        self.stamps = {g: stamp for g, stamp in old.stamps.items() if g in there}
        points = {g: before.snapshot.point_set(g) for g in self.heard}
        context.set_points(self.source, points)
        if self.images is not None and old.images is not None:
            self.images.take_over(old.images)

    def stamp(self) -> int:
        """Return the newest stamp of points, nanoseconds."""
        return max(self.stamps.values(), default=UNSTAMPED)

    def forget(self, after: int) -> None:
        """Forget stamps later than that; the points hold."""
        self.stamps = {g: stamp for g, stamp in self.stamps.items() if stamp <= after}
        if self.images is not None:
            self.images.forget(after)


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
