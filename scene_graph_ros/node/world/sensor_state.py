"""A source's sensor, of images of depth or clouds, and the look at a message. No rclpy here.

Imported where a source has a cloud, or a sensor that fills a voxel grid.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.scene_files.sensor_settings import (
    AS_THEY_ARE,
    DepthSettings,
    SensorSettings,
)
from scene_graph_ros.sensing import DepthRules, NewPoints, SeenPoints, SelfFilter
from scene_graph_ros.sensing.seen_voxels import FOREVER, SeenVoxels

if TYPE_CHECKING:
    from msg_adapters.depth_images import SensedLens
    from msg_adapters.names import SceneNames
    from scene_graph_ros.geometry.perception import CameraDescription
    from scene_graph_ros.sensing import CloudView, DepthView

__all__ = ["Looked", "SensorFrame", "SensorState", "Surroundings", "states_of"]


class SensorFrame(NamedTuple):
    """A sensor's own frame S, of a camera the optical one, on a frame of the scene."""

    frame: FrameId
    X_FS: NDArray[np.float64]


class Looked(NamedTuple):
    """What a message, taken at ``stamp`` ns, has told."""

    new: NewPoints
    """Its points, without the robot's."""
    stamp: int
    seen: Any
    """All SeenPoints or SeenVoxels after it."""
    counts: Any
    """Counts of the points, or VoxelsSeen."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What messages are looked at in: one version of the scene."""

    inspector: Any
    robots: frozenset[SourceId]
    sources: Mapping[str, SourceId]
    cameras: Mapping[str, SensorFrame]
    """The scene's own cameras, by the names of their optical frames."""
    place: Callable[[Iterable[FrameId], int], Mapping[FrameId, NDArray[np.float64]]]
    """Returns ``X_WF`` of frames at a time, ns; raises NotYetError and PastError."""

    def bodies(self, names: Iterable[str] | None) -> tuple[list[GeometryId], list[GeometryId]]:
        """Return the geometries that are taken out of messages: those of sources, and their load.

        Without names those of all robots; their load is what hangs on their frames. A source that
        is gone has none.
        """
        inspector, sources = self.inspector, self.sources
        if names is None:
            taken = set(self.robots)
        else:
            taken = {sources[name] for name in names if name in sources}
        world = inspector.world_frame_id()
        own: list[GeometryId] = []
        load: list[GeometryId] = []
        for geometry in inspector.get_all_geometry_ids(Role.PROXIMITY):
            frame = inspector.get_frame_id(geometry)
            if inspector.get_owning_source_id(geometry) in taken:
                own.append(geometry)
                continue
            while frame != world:
                if inspector.get_owning_source_id(frame) in taken:
                    load.append(geometry)
                    break
                frame = inspector.get_parent_frame(frame)
        return own, load


@dataclass
class SensorState:
    """The lens, the place in time and the newest points of one sensor."""

    settings: SensorSettings
    surroundings: Surroundings
    number: int
    """Of the sensor, among those that fill the same cloud."""
    lens: SensedLens | None = None
    newest: NewPoints | None = None
    """The points of the newest message, without the robot's."""
    stamp: int = UNSTAMPED
    """Of the newest message, ns."""
    _filters: tuple[SelfFilter, SelfFilter] | None = None

    def rules(self, error: float) -> DepthRules:
        """Return the rules of messages whose points have this error, m."""
        its = self.settings
        return DepthRules(
            step=its.step if isinstance(its, DepthSettings) else 1,
            near=its.near,
            far=its.far,
            error=error,
            padding=its.padding,
            shadow=its.shadow,
            margin=its.margin,
            lower=its.lower,
            upper=its.upper,
        )

    @property
    def filters(self) -> tuple[SelfFilter, SelfFilter]:
        """The bodies that are taken out of messages, and of them the load; made with the first."""
        if self._filters is None:
            around = self.surroundings
            own, load = around.bodies(self.settings.remove)
            inspector = around.inspector
            self._filters = SelfFilter(inspector, [*own, *load]), SelfFilter(inspector, load)
        return self._filters

    def look(
        self,
        view_of: Callable[[DepthRules, SelfFilter], DepthView | CloudView],
        X_WF: Mapping[FrameId, NDArray[np.float64]],
        seen: SeenPoints | SeenVoxels,
        stamp: int,
        error: float,
        most: int,
    ) -> Looked:
        """Look at a message, with all frames where they were then; any thread, one at a time.

        ``seen`` are the points before, of which ``most`` are kept, or the voxels; ``view_of``
        makes the message's view. Nothing but the places of the filters changes.
        """
        own, load = self.filters
        own.place(X_WF)
        if load.frames:
            # It was an obstacle until it was grasped: what was seen of it then is forgotten.
            load.place(X_WF)
            seen = seen.without(load, self.settings.padding)
        view = view_of(self.rules(error), own)
        new = view.points()
        if isinstance(seen, SeenVoxels):
            expires = int(self.settings.expires * 1e9)
            until = stamp + expires if expires else FOREVER
            return Looked(new, stamp, *seen.after(view, until, self.number))
        if self.settings.remembers:
            return Looked(new, stamp, *seen.after(view, new, stamp, most, self.number))
        return Looked(new, stamp, *seen.replaced(new, stamp, most, self.number))

    def take(self, looked: Looked) -> None:
        """Have a message's points as the newest."""
        self.newest, self.stamp = looked.new, looked.stamp

    def forget(self, after: int) -> None:
        """Forget stamps later than that: the clock jumped."""
        self.stamp = UNSTAMPED if self.stamp > after else self.stamp

    def take_over(self, old: SensorState) -> None:
        """Have what the same sensor told in the scene before."""
        self.lens, self.newest, self.stamp = old.lens, old.newest, old.stamp


def states_of(
    records: Mapping[str, Any],
    names: SceneNames,
    inspector: Any,
    cameras: Mapping[str, CameraDescription],
    place: Callable[[Iterable[FrameId], int], Mapping[FrameId, NDArray[np.float64]]],
) -> dict[str, SensorState]:
    """Return the states of all sources' sensors, of which nothing was heard yet.

    ``records`` are those of all sources by name.
    """
    optical = {}
    for camera in cameras.values():
        try:
            frame = (
                inspector.world_frame_id()
                if camera.frame == "world"
                else names.frame_id(camera.frame, camera.source)
            )
        except UnknownIdError:  # it is gone, and the camera stale
            continue
        optical[f"{camera.name}_optical_frame"] = SensorFrame(frame, camera.X_PC)
    around = Surroundings(
        inspector,
        frozenset(record.id for record in records.values() if record.robot is not None),
        {name: record.id for name, record in records.items()},
        optical,
        place,
    )
    return {
        name: SensorState(record.sensor or AS_THEY_ARE, around, number)
        for number, (name, record) in enumerate(records.items())
    }
