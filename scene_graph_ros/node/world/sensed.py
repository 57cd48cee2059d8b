"""Geometry that sensors fill: the common part of clouds and voxel grids. No rclpy here."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.intake import UNSTAMPED

if TYPE_CHECKING:
    from scene_graph_ros.node.world.sensor_state import Looked, SensorState

__all__ = ["NotFilledError", "SensedGeometry", "ids_by_name"]


class NotFilledError(UnknownIdError):
    """Messages of a source that fill none of its geometries, or may fill several."""


@dataclass
class SensedGeometry(ABC):
    """The geometries of one kind of one source, one of which messages of sensors fill.

    ``ids`` are the geometries by name; ``heard`` are those that a message filled. ``sensors`` are
    the states of the sensors by the names of their sources.
    """

    noun: ClassVar[str]
    """The kind of geometry."""

    source: SourceId
    source_name: str
    wanted: str
    """The name of the geometry that messages are about, "" for the only one."""
    ids: Mapping[str, list[GeometryId]]
    names: SceneNames
    inspector: Any
    world_frame: str
    heard: set[GeometryId] = field(default_factory=set)
    sensors: dict[str, SensorState] = field(default_factory=dict)
    look: object | None = None
    """The one at a message that has no result yet: the next one begins with its result."""

    @abstractmethod
    def seen(self) -> Any:
        """Return all that was seen so far, as `SensorState.look` takes it."""

    @abstractmethod
    def error(self, geometry_id: GeometryId) -> float:
        """Return the error of a depth that the geometry stands for, m."""

    @abstractmethod
    def take(self, looked: Looked, geometry_id: GeometryId, X_WG: NDArray[np.float64]) -> None:
        """Take all points or voxels after a message; the geometry was at ``X_WG`` then."""

    @abstractmethod
    def told(self, looked: Looked, message: str) -> dict[str, int]:
        """Return the counts of a message for diagnostics, by name."""

    @abstractmethod
    def expire(self, now: int) -> bool:
        """Forget points or voxels that were seen too long ago; tell whether there were any."""

    @abstractmethod
    def bring(self, context: Context) -> None:
        """Give a context fresh points or voxels."""

    def geometry(self) -> GeometryId:
        """Return the geometry that messages are about. Raises NotFilledError."""
        named = [name for name in self.ids if self.wanted in ("", name)]
        found = [geometry_id for name in named for geometry_id in self.ids[name]]
        if len(found) != 1:
            raise NotFilledError(self._no_choice(len(found)))
        return found[0]

    def _no_choice(self, count: int) -> str:
        """Say why no geometry, or none of several, is meant."""
        names = quoted(sorted(self.ids))
        if not count:
            return f"the source has no {self.noun} {quoted(self.wanted)}, but {names}"
        if self.wanted:
            return f"{count} {self.noun}s of the source are called {quoted(self.wanted)}"
        return (
            f"the source has {count} {self.noun}s, {names}: name the one that it sends in the"
            " scene file, sources: points: geometry; or have a source for each"
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

    def stamp(self) -> int:
        """Return the newest stamp of messages, nanoseconds."""
        return max((state.stamp for state in self.sensors.values()), default=UNSTAMPED)

    def forget(self, after: int) -> None:
        """Forget stamps later than that, and the present look; points and voxels hold."""
        self.look = None
        for state in self.sensors.values():
            state.forget(after)


def ids_by_name(ids: Iterable[GeometryId], inspector: Any) -> dict[str, list[GeometryId]]:
    """Return geometries by their names; names need not be unique."""
    by_name: dict[str, list[GeometryId]] = defaultdict(list)
    for geometry_id in ids:
        by_name[inspector.get_name(geometry_id)].append(geometry_id)
    return dict(by_name)
