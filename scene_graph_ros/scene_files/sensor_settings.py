"""A source's sensor: where it is, and which pixels or points of its messages count.

A node without scene files needs these alone: nothing of the schema is imported.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line

__all__ = [
    "AS_THEY_ARE",
    "EVERYWHERE",
    "FLAT_MAPS",
    "NOWHERE",
    "OCCUPANCY_GRID",
    "DepthSettings",
    "SensorSettings",
    "VoxelSettings",
]

EVERYWHERE = (math.inf, math.inf, math.inf)
NOWHERE = (-math.inf, -math.inf, -math.inf)
"""Upper and lower corners, m, of a region that leaves nothing out."""


@one_line()
@dataclass(frozen=True, eq=False, kw_only=True)
class SensorSettings:
    """Of a sensor's messages; lengths in m."""

    frame: str = ""
    """The frame that the sensor is on, "" for the one that the messages name."""
    X_FS: NDArray[np.float64]
    """The sensor's pose ``(4, 4)`` in that frame."""
    fills: str = ""
    """The source whose geometry is filled, "" for the sensor's own."""
    into_voxels: bool = False
    """Whether that of its own source is a voxel grid in place of a cloud."""
    rate: float
    """Most messages per second, infinite for all."""
    near: float = 0.0
    far: float = math.inf
    remove: tuple[str, ...] | None = None
    """Names of sources; None for all robots."""
    padding: float
    shadow: int
    margin: float
    remembers: bool
    """Whether points hold until a ray goes through them, or a message has all of its sensor."""
    expires: float = 0.0
    """Seconds, 0 for never."""
    lower: tuple[float, float, float] = NOWHERE
    upper: tuple[float, float, float] = EVERYWHERE
    """Corners of the region of interest in the world."""

    @property
    def has_radii(self) -> bool:
        """Whether each point gets a radius of its own, or has that of the cloud's shape."""
        return isinstance(self, DepthSettings)


@one_line()
@dataclass(frozen=True, eq=False, kw_only=True)
class DepthSettings(SensorSettings):
    """Of images of depth."""

    image_topic: str
    info_topic: str
    is_rectified: bool
    step: int


AS_THEY_ARE = SensorSettings(
    X_FS=np.eye(4), rate=math.inf, remove=(), padding=0.0, shadow=0, margin=0.0, remembers=False
)
"""Of clouds of which a scene says nothing: each message has all points, and none is taken out."""

OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"


@one_line()
@dataclass(frozen=True, kw_only=True)
class VoxelSettings:
    """Of maps that fill a voxel grid."""

    type: str = OCCUPANCY_GRID
    topic: str = ""
    """Empty for the default topic."""
    geometry: str = ""
    """The name of the grid, "" for the source's only one."""
    occupied: int = 65
    free: int = 25
    """Per cents of a flat map's cells: at least, and at most."""


FLAT_MAPS = VoxelSettings()
"""Of grids of which a scene says nothing."""
