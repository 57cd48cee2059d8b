"""A snapshot of the world: the poses, names and stamps of one moment."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
import threading
from typing import Any, NamedTuple, TYPE_CHECKING, TypeVar

import numpy as np

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.spatial.record_kernels import latest
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.world.clouds import SourceClouds
from scene_graph_ros.node.world.deformables import SourceDeformables
from scene_graph_ros.node.world.intake import SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.scene_robots import SceneRobots

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.perception import CameraDescription

__all__ = ["STATIC", "SeenImage", "SourceStamps", "WorldSnapshot"]

T = TypeVar("T")

STATIC = np.iinfo(np.int64).max
"""Stamp of what never gets old."""


@dataclass(frozen=True, eq=False)
class SourceStamps:
    """The stamps of a source's frames, nanoseconds: ``ids`` and ``stamps`` ``(n,)``, as of then.

    ``newest`` is the largest that a message said; ``stamp`` is that of the source as a whole.
    """

    ids: tuple[Any, ...]
    stamps: NDArray[np.int64]
    is_static: NDArray[np.bool_]
    newest: int
    stamp: int
    joint_stamps: Mapping[str, int] = field(default_factory=dict)
    """Those of a robot's joints, and of BASE: STATIC where they were sent for good."""

    @classmethod
    def of(
        cls,
        frames: SourceFrames,
        deformables: SourceDeformables | None,
        clouds: SourceClouds | None,
        record: SourceRecord,
    ) -> SourceStamps:
        """Return those of a source now."""
        stamps, is_static = frames.stamps.copy(), frames.is_static.copy()
        newest = int(latest(stamps))
        if record.motion is not None:
            newest = max(newest, int(latest(record.motion.stamps)))
        if deformables is not None:
            newest = max(newest, deformables.stamp())
        if clouds is not None:
            newest = max(newest, clouds.stamp())
        stamp = newest
        if record.motion is not None and len(stamps):
            stamp = int(np.where(is_static, STATIC, stamps).min())
        elif len(stamps) and is_static.all() and deformables is None and clouds is None:
            stamp = STATIC
        joints = {} if record.motion is None else record.motion.joint_stamps(STATIC)
        return cls(frames.ids, stamps, is_static, newest, stamp, joints)

    @made_once
    def by_frame(self) -> Mapping[Any, int]:
        """The stamp of each frame in its parent: STATIC where nothing moves it."""
        ages = np.where(self.is_static, STATIC, self.stamps).tolist()
        return dict(zip(self.ids, ages, strict=True))


class SeenImage(NamedTuple):
    """The points of an image, without those of the robot: in the world ``(n, 3)``, m."""

    stamp: int
    p_WPs: NDArray[np.float64]
    radii: NDArray[np.float64]


@dataclass(frozen=True)
class WorldSnapshot:
    """The world at one time. Nothing in it changes any more.

    ``records`` are its sources by name, ``deforming`` the names of those with deformable geometry,
    ``sensing`` of those with clouds, ``cameras`` the cameras by name, also those whose frame is
    gone.
    ``stamp`` is the newest stamp among its poses, ``stamps`` has those of each source's frames;
    nanoseconds of the node's clock, STATIC for those that never get old. ``arrival`` is when the
    oldest message that this update applied arrived, nanoseconds of the steady clock; None where
    no message led to it.
    ``robots`` are those of its scene, ``positions`` of each the joints' positions, by name of the
    source, in the order of its ``kinematics.position_names``, ``bases`` where its root link is.
    """

    query: QueryObject
    names: SceneNames
    records: Mapping[str, SourceRecord]
    deforming: frozenset[str]
    scene_version: int
    sequence: int
    stamp: int
    stamps: Mapping[str, SourceStamps]
    robots: SceneRobots
    positions: Mapping[str, NDArray[np.float64]]
    bases: Mapping[str, NDArray[np.float64]]
    arrival: int | None = None
    cameras: Mapping[str, CameraDescription] = field(default_factory=dict)
    sensing: frozenset[str] = frozenset()
    has_elements: bool = False
    """Whether there are clouds or height fields to measure."""
    images: Mapping[str, SeenImage] = field(default_factory=dict)
    """The newest image of depth by source, of those that sent one."""
    _turns: dict[Hashable, threading.Lock] = field(default_factory=dict, repr=False)

    def ask(self, question: Callable[..., T], *arguments: Hashable) -> T:
        """Return the answer of a method of ``QueryObject`` about this snapshot.

        A thread that asks the same as another waits for its answer, which the query remembers: to
        compute it twice side by side would take longer for both.
        """
        with self._turns.setdefault((question, arguments), threading.Lock()):
            return question(self.query, *arguments)

    def source_stamp(self, source: str) -> int:
        """Return the stamp of a source in nanoseconds; UNSTAMPED where it was not heard.

        A robot is as old as the oldest joint that moves one of its links; the frames of other
        sources move each for itself, and the newest counts.
        """
        stamps = self.stamps.get(source)
        return UNSTAMPED if stamps is None else stamps.stamp

    def joint_stamp(self, path: str) -> int | None:
        """Return the stamp of a robot's joint, ``robot/joint``; None where there is none."""
        source, _, joint = path.partition("/")
        stamps = self.stamps.get(source)
        return stamps.joint_stamps.get(joint) if stamps is not None and joint else None

    def frame_stamp(self, path: str) -> int:
        """Return the stamp of a frame, ``source/frame``: of the oldest that it depends on.

        Raises UnknownIdError or NameConflictError for its name.
        """
        frame_id, inspector = self.names.frame_id(path), self.inspector
        world, stamp = inspector.world_frame_id(), STATIC
        while frame_id != world:
            owner = inspector.get_name(inspector.get_owning_source_id(frame_id))
            stamp = min(stamp, self.stamps[owner].by_frame.get(frame_id, UNSTAMPED))
            frame_id = inspector.get_parent_frame(frame_id)
        return stamp

    @property
    def inspector(self) -> Any:
        """Introspect the model of this snapshot."""
        return self.query.inspector()
