"""A source's images of depth, as far as its cloud is concerned. No rclpy here.

Imported where a source has the settings of such images.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import Role
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.spatial.poses import compose
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.scene_files.loaded_scene import DepthSettings
from scene_graph_ros.sensing import (
    Counts,
    DepthRules,
    DepthView,
    NewPoints,
    SeenPoints,
    SelfFilter,
)

if TYPE_CHECKING:
    from msg_adapters.depth_images import DepthImage, SensedLens
    from msg_adapters.names import SceneNames
    from scene_graph_ros.geometry.perception import CameraDescription

__all__ = ["DepthState", "OpticalFrame", "Surroundings", "states_of"]


class OpticalFrame(NamedTuple):
    """A camera's optical frame C, on a frame of the scene."""

    frame: FrameId
    X_FC: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What images are looked at in: one version of the scene."""

    inspector: Any
    robots: frozenset[SourceId]
    sources: Mapping[str, SourceId]
    cameras: Mapping[str, OpticalFrame]
    """The scene's own cameras, by the names of their optical frames."""
    place: Callable[[Iterable[FrameId], int], Mapping[FrameId, NDArray[np.float64]]]
    """Returns ``X_WF`` of frames at a time, ns; raises NotYetError and PastError."""

    def bodies(self, names: Iterable[str] | None) -> tuple[list[GeometryId], list[GeometryId]]:
        """Return the geometries that are taken out of images: those of sources, and their load.

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
class DepthState:
    """The lens, and the points that were seen, of one source."""

    settings: DepthSettings
    surroundings: Surroundings
    lens: SensedLens | None = None
    seen: SeenPoints = field(default_factory=SeenPoints.none)
    newest: NewPoints | None = None
    """The points of the newest image, without the robot's."""
    stamp: int = UNSTAMPED
    """Of the newest image, ns."""
    _filters: tuple[SelfFilter, SelfFilter] | None = None

    def rules(self, error: float) -> DepthRules:
        """Return the rules of images whose depths have this error, m."""
        its = self.settings
        return DepthRules(
            step=its.step,
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
        """The bodies that are taken out of images, and of them the load; made with the first."""
        if self._filters is None:
            around = self.surroundings
            own, load = around.bodies(self.settings.remove)
            inspector = around.inspector
            self._filters = SelfFilter(inspector, [*own, *load]), SelfFilter(inspector, load)
        return self._filters

    def look(
        self,
        image: DepthImage,
        optical: OpticalFrame,
        X_WF: Mapping[FrameId, NDArray[np.float64]],
        error: float,
        most: int,
    ) -> Counts:
        """Take an image, with all frames where they were then; ``most`` points are kept."""
        assert self.lens is not None
        own, load = self.filters
        own.place(X_WF)
        if load.frames:
            # It was an obstacle until it was grasped: what was seen of it then is forgotten.
            load.place(X_WF)
            held = load.near(self.seen.p_WPs, self.settings.padding)
            self.seen = self.seen.only(~held)
        X_WC = compose(X_WF[optical.frame], optical.X_FC)
        view = DepthView.of(image.depth, self.lens.lens, X_WC, self.rules(error), own)
        self.newest = view.points()
        self.seen, counts = self.seen.after(view, self.newest, image.stamp_ns, most)
        self.stamp = image.stamp_ns
        return counts

    def forget(self, after: int) -> None:
        """Forget stamps later than that: the clock jumped."""
        self.stamp = UNSTAMPED if self.stamp > after else self.stamp
        self.seen = self.seen.stamped_at_most(after)

    def expire(self, now: int) -> bool:
        """Forget points that were seen too long ago; tell whether there were any."""
        if not self.settings.expires or now <= 0:
            return False
        before = self.seen
        self.seen = before.since(now - int(self.settings.expires * 1e9))
        return self.seen is not before

    def take_over(self, old: DepthState) -> None:
        """Have what the same source saw in the scene before."""
        self.lens, self.seen = old.lens, old.seen
        self.newest, self.stamp = old.newest, old.stamp


def states_of(
    records: Mapping[str, Any],
    names: SceneNames,
    inspector: Any,
    cameras: Mapping[str, CameraDescription],
    place: Callable[[Iterable[FrameId], int], Mapping[FrameId, NDArray[np.float64]]],
) -> dict[str, DepthState]:
    """Return the states of all sources that send images, of which nothing was seen yet.

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
        optical[f"{camera.name}_optical_frame"] = OpticalFrame(frame, camera.X_PC)
    around = Surroundings(
        inspector,
        frozenset(record.id for record in records.values() if record.robot is not None),
        {name: record.id for name, record in records.items()},
        optical,
        place,
    )
    return {
        name: DepthState(record.depth, around)
        for name, record in records.items()
        if record.depth is not None
    }
