"""When the things of a source were heard. No rclpy here."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np

from scene_graph_ros.node.runtime.made_once import made_once

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["STATIC", "SeenImage", "SourceStamps", "seen_until"]

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

    @made_once
    def by_frame(self) -> Mapping[Any, int]:
        """The stamp of each frame in its parent: STATIC where nothing moves it."""
        ages = np.where(self.is_static, STATIC, self.stamps).tolist()
        return dict(zip(self.ids, ages, strict=True))


def seen_until(
    images: Mapping[str, SeenImage], records: Mapping[str, Any], sensing: Container[str]
) -> int | None:
    """Return the time, ns, until which a world has all images and clouds, None without sensors.

    That is the newest stamp of the sensor that is behind all others; 0 where one has sent nothing.
    Of sensors only those count that remember: the others may send once, for good. ``images`` are
    the newest by source, ``records`` all sources, ``sensing`` those that sensors fill.
    """
    stamps = [
        max(images[name].stamp, 0) if name in images else 0
        for name, each in records.items()
        if each.sensor is not None and each.sensor.remembers and each.filled in sensing
    ]
    return min(stamps, default=None)


class SeenImage(NamedTuple):
    """The points of an image or cloud, without the robot's: in the world ``(n, 3)``, m."""

    stamp: int
    p_WPs: NDArray[np.float64]
    radii: NDArray[np.float64]
