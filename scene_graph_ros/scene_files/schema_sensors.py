"""A source's sensor in scene files: images of depth or clouds, and which of them are points."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from scene_graph_ros.scene_files.schema_values import (
    Coordinate,
    Name,
    Number,
    PoseSpec,
    Positive,
    Reference,
    Spec,
    Text,
)

__all__ = ["DepthSpec", "PointsSpec", "RegionSpec", "SensorSpec", "VoxelsSpec"]

Corner = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Length = Annotated[Number, Field(ge=0.0, le=10.0)]
Pixels = Annotated[int, Field(strict=True, ge=0, le=64)]
Percent = Annotated[int, Field(strict=True, ge=0, le=100)]
Rate = Annotated[Number, Field(ge=1e-3, le=1e3)]
Span = Annotated[list[Positive], Field(min_length=2, max_length=2)]


class RegionSpec(Spec):
    """A box along the axes of the world, metres."""

    lower: Corner
    upper: Corner

    @model_validator(mode="after")
    def _has_room(self) -> RegionSpec:
        if any(low >= high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"lower {self.lower} must be below upper {self.upper} on each axis")
        return self


class SensorSpec(Spec):
    """What messages of a sensor are used, and what of them is a point."""

    frame: Reference | None = Field(
        None,
        description="The frame that the sensor is on; default: the messages' frame_id, which is "
        "then the sensor's own frame.",
    )
    pose: PoseSpec = Field(
        PoseSpec(),
        description="Of the sensor's frame in that frame; a camera's is optical: x right, y down, "
        "z ahead.",
    )
    geometry: Name | None = Field(
        None,
        description="Which of its clouds, or grids, is filled, of a source that has several.",
    )
    into: Literal["point_cloud", "voxel_grid"] = Field(
        "point_cloud",
        description="What of the source is filled: its cloud, or its voxel grid, of which rays "
        "free what they go through; what they do not show stays as it was, such as unknown.",
    )
    fills: Name | None = Field(
        None,
        description="The source whose cloud, or grid, is filled in place of its own, with others.",
    )
    rate: Rate | None = Field(None, description="Most messages used per second; default: all.")
    range: Span | None = Field(
        None, description="Least and largest depth at which the sensor sees, metres."
    )
    remove: list[Reference] | None = Field(
        None,
        description="Sources whose geometry is taken out of what is seen; default: all robots. "
        "What a robot holds is always taken out with it.",
    )
    padding: Length = Field(0.02, description="Points so near to that are taken for it, metres.")
    shadow: Pixels = Field(
        2,
        description="Pixels, or neighbours, beside it that are no points: sensors mix there what "
        "is in front.",
    )
    margin: Length = Field(
        0.02, description="A ray that goes on behind a point by more than this clears it, metres."
    )
    expires: Positive | None = Field(
        None,
        description="Seconds after which a point that was not seen again is gone; a voxel is "
        "unknown then.",
    )
    region: RegionSpec | None = Field(None, description="What is outside of it is no point.")
    floor: Coordinate | None = Field(
        None, description="What is lower than this in the world is no point, metres."
    )

    @model_validator(mode="after")
    def _fits(self) -> SensorSpec:
        if self.range is not None and self.range[0] >= self.range[1]:
            raise ValueError(f"range: {self.range[0]:g} must be less than {self.range[1]:g}")
        if "pose" in self.model_fields_set and self.frame is None:
            raise ValueError("pose needs the frame that it is given in")
        if self.fills is not None and self.geometry is not None:
            raise ValueError("geometry is named by the source that is filled, of its own sensor")
        if self.fills is not None and "into" in self.model_fields_set:
            raise ValueError("into is said by the source that is filled, of its own sensor")
        return self


class DepthSpec(SensorSpec):
    """A camera's images of depth: sensor_msgs/Image, and the CameraInfo of their lens."""

    image: Text = Field(description="The images' topic: 16UC1 in mm, or 32FC1 in metres.")
    info: Text | None = Field(
        None, description='The topic of the lens; default: "camera_info" beside the images\'.'
    )
    rectified: bool = Field(
        False, description="The images are rectified: the lens is P of its message, not K and D."
    )
    rate: Rate | None = Field(10.0, description="Most images used per second.")
    step: Annotated[int, Field(strict=True, ge=1, le=64)] = Field(
        2, description="Of each block of so many pixels squared the nearest is a point."
    )
    range: Span | None = Field(
        [0.05, 10.0], description="Least and largest depth at which the camera sees, metres."
    )


class PointsSpec(SensorSpec):
    """A sensor's clouds: sensor_msgs/PointCloud2."""

    topic: Text | None = Field(None, description='Default: "<source>/points".')
    remember: bool = Field(
        False,
        description="Points hold until a later ray goes through them, or they expire; else each "
        "message has all points of its sensor.",
    )

    @model_validator(mode="after")
    def _holds(self) -> PointsSpec:
        if self.into == "voxel_grid" and not self.remember:
            raise ValueError("into: voxel_grid needs remember: true: a grid holds what was seen")
        return self


class VoxelsSpec(Spec):
    """A mapper's maps, of which a voxel grid is filled."""

    type: Literal["nav_msgs/msg/OccupancyGrid", "octomap_msgs/msg/Octomap"] = Field(
        "nav_msgs/msg/OccupancyGrid", description="Of the messages; a flat map holds at all z."
    )
    topic: Text | None = Field(None, description='Default: "<source>/voxels".')
    geometry: Name | None = Field(
        None, description="Which of its voxel grids is filled, of a source that has several."
    )
    occupied: Percent = Field(
        65, description="Cells of a flat map with so many per cent, or more, are occupied."
    )
    free: Percent = Field(
        25, description="Those with so many, or less, are free, and those in between unknown."
    )

    @model_validator(mode="after")
    def _are_apart(self) -> VoxelsSpec:
        if self.free >= self.occupied:
            raise ValueError(f"free: {self.free} must be less than occupied: {self.occupied}")
        return self
