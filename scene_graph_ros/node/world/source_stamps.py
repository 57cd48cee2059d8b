"""How old the frames of a source are, in a snapshot. No rclpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.record_kernels import latest
from scene_graph_ros.node.world.intake import SourceFrames

if TYPE_CHECKING:
    from scene_graph_ros.node.world.deformables import SourceDeformables
    from scene_graph_ros.node.world.scene import SourceRecord

__all__ = ["STATIC", "SourceStamps"]

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

    @classmethod
    def of(
        cls, frames: SourceFrames, deformables: SourceDeformables | None, record: SourceRecord
    ) -> SourceStamps:
        """Return those of a source now."""
        stamps, is_static = frames.stamps.copy(), frames.is_static.copy()
        newest = int(latest(stamps))
        if record.motion is not None:
            newest = max(newest, int(latest(record.motion.stamps)))
        if deformables is not None:
            newest = max(newest, deformables.stamp())
        stamp = newest
        if record.motion is not None and len(stamps):
            stamp = int(np.where(is_static, STATIC, stamps).min())
        elif len(stamps) and is_static.all() and deformables is None:
            stamp = STATIC
        return cls(frames.ids, stamps, is_static, newest, stamp)

    @cached_property
    def by_frame(self) -> Mapping[Any, int]:
        """The stamp of each frame in its parent: STATIC where nothing moves it."""
        ages = np.where(self.is_static, STATIC, self.stamps).tolist()
        return dict(zip(self.ids, ages, strict=True))
