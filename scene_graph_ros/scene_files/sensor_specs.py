"""A source's sensor as a scene file has it, to its settings."""

from __future__ import annotations

import math
import posixpath

from scene_graph_ros.scene_files.instances import pose_from_spec
from scene_graph_ros.scene_files.schema_sensors import (
    DepthSpec,
    PointsSpec,
    SensorSpec,
    VoxelsSpec,
)
from scene_graph_ros.scene_files.sensor_settings import (
    DepthSettings,
    EVERYWHERE,
    NOWHERE,
    SensorSettings,
    VoxelSettings,
)

__all__ = ["sensor_settings", "voxel_settings"]


def sensor_settings(spec: SensorSpec, prefix: str) -> SensorSettings:
    """Return a sensor's settings; sources that it names have the scene's prefix."""
    region, floor = spec.region, -math.inf if spec.floor is None else spec.floor
    low = NOWHERE if region is None else tuple(region.lower)
    high = EVERYWHERE if region is None else tuple(region.upper)
    frame = spec.frame or ""
    near, far = (0.0, math.inf) if spec.range is None else spec.range
    common = SensorSettings(
        frame=prefix + frame if "/" in frame else frame,
        X_FS=pose_from_spec(spec.pose, "pose"),
        fills="" if spec.fills is None else prefix + spec.fills,
        into_voxels=spec.into == "voxel_grid",
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


def voxel_settings(spec: VoxelsSpec) -> VoxelSettings:
    """Return the settings of a mapper's maps."""
    return VoxelSettings(
        type=spec.type,
        topic=spec.topic or "",
        geometry=spec.geometry or "",
        occupied=spec.occupied,
        free=spec.free,
    )
