"""When the things of a source were heard. No rclpy here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry.spatial.record_kernels import latest
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.world.deformables import SourceDeformables
from scene_graph_ros.node.world.intake import SourceFrames
from scene_graph_ros.node.world.scene import SourceRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["STATIC", "SeenImage", "SourceStamps"]

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
        sensed: Iterable[int],
        record: SourceRecord,
    ) -> SourceStamps:
        """Return those of a source now; ``sensed`` are those of points and heights, ns."""
        stamps, is_static = frames.stamps.copy(), frames.is_static.copy()
        newest = int(latest(stamps))
        if record.motion is not None:
            newest = max(newest, int(latest(record.motion.stamps)))
        if deformables is not None:
            newest = max(newest, deformables.stamp())
        sensed = tuple(sensed)
        newest = max(newest, *sensed) if sensed else newest
        stamp = newest
        if record.motion is not None and len(stamps):
            stamp = int(np.where(is_static, STATIC, stamps).min())
        elif len(stamps) and is_static.all() and deformables is None and not sensed:
            stamp = STATIC
        joints = {} if record.motion is None else record.motion.joint_stamps(STATIC)
        return cls(frames.ids, stamps, is_static, newest, stamp, joints)

    @made_once
    def by_frame(self) -> Mapping[Any, int]:
        """The stamp of each frame in its parent: STATIC where nothing moves it."""
        ages = np.where(self.is_static, STATIC, self.stamps).tolist()
        return dict(zip(self.ids, ages, strict=True))


class SeenImage(NamedTuple):
    """The points of an image or cloud, without the robot's: in the world ``(n, 3)``, m."""

    stamp: int
    p_WPs: NDArray[np.float64]
    radii: NDArray[np.float64]
