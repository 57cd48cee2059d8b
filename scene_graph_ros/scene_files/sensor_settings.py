"""A source's sensor: where it is, and which pixels or points of its messages count."""

from __future__ import annotations

from dataclasses import dataclass
import math
import posixpath

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.scene_files.instances import pose_from_spec
from scene_graph_ros.scene_files.schema_sensors import DepthSpec, PointsSpec, SensorSpec

__all__ = ["AS_THEY_ARE", "DepthSettings", "SensorSettings", "sensor_settings"]

_EVERYWHERE = (math.inf, math.inf, math.inf)
_NOWHERE = (-math.inf, -math.inf, -math.inf)


@one_line()
@dataclass(frozen=True, eq=False, kw_only=True)
class SensorSettings:
    """Of a sensor's messages; lengths in m."""

    frame: str = ""
    """The frame that the sensor is on, "" for the one that the messages name."""
    X_FS: NDArray[np.float64]
    """The sensor's pose ``(4, 4)`` in that frame."""
    fills: str = ""
    """The source whose cloud is filled, "" for the sensor's own."""
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
    lower: tuple[float, float, float] = _NOWHERE
    upper: tuple[float, float, float] = _EVERYWHERE
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


def sensor_settings(spec: SensorSpec, prefix: str) -> SensorSettings:
    """Return a sensor's settings; sources that it names have the scene's prefix."""
    region, floor = spec.region, -math.inf if spec.floor is None else spec.floor
    low = _NOWHERE if region is None else tuple(region.lower)
    high = _EVERYWHERE if region is None else tuple(region.upper)
    frame = spec.frame or ""
    near, far = (0.0, math.inf) if spec.range is None else spec.range
    common = SensorSettings(
        frame=prefix + frame if "/" in frame else frame,
        X_FS=pose_from_spec(spec.pose, "pose"),
        fills="" if spec.fills is None else prefix + spec.fills,
        rate=spec.rate or math.inf,
        near=near,
        far=far,
        remove=None if spec.remove is None else tuple(prefix + name for name in spec.remove),
        padding=spec.padding,
        shadow=spec.shadow,
        margin=spec.margin,
        remembers=isinstance(spec, DepthSpec) or (isinstance(spec, PointsSpec) and spec.remember),
        expires=spec.expires or 0.0,
        lower=(low[0], low[1], max(low[2], floor)),
        upper=(high[0], high[1], high[2]),
    )
    if not isinstance(spec, DepthSpec):
        return common
    return DepthSettings(
        **vars(common),
        image_topic=spec.image,
        info_topic=spec.info or posixpath.join(posixpath.dirname(spec.image), "camera_info"),
        is_rectified=spec.rectified,
        step=spec.step,
    )
