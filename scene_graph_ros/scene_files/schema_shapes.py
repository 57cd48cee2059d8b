"""The part of the scene files' schema that describes shapes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator, StringConstraints

from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE

__all__ = [
    "BoxSpec",
    "CapsuleSpec",
    "ConvexSpec",
    "CylinderSpec",
    "EllipsoidSpec",
    "HalfSpaceSpec",
    "HeightFieldSpec",
    "MeshSpec",
    "PointCloudSpec",
    "ShapeSpec",
    "SphereSpec",
    "VoxelGridSpec",
]

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Size = Annotated[Number, Field(gt=0.0, le=MAX_SHAPE_SIZE)]
Radius = Annotated[Number, Field(ge=0.0, le=MAX_SHAPE_SIZE)]
Sizes = Annotated[list[Size], Field(min_length=3, max_length=3)]
Scale = Number | Annotated[list[Number], Field(min_length=3, max_length=3)]
Vertex = Annotated[list[Number], Field(min_length=3, max_length=3)]
Lengths = Annotated[list[Size], Field(min_length=2, max_length=2)]
Coordinate = Annotated[Number, Field(ge=-MAX_SHAPE_SIZE, le=MAX_SHAPE_SIZE)]
Row = Annotated[list[Number], Field(min_length=2)]
Index = Annotated[int, Field(strict=True, ge=0)]
Triangle = Annotated[list[Index], Field(min_length=3, max_length=3)]
Text = Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1)]


class _Spec(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SphereSpec(_Spec):
    """A ball."""

    type: Literal["sphere"]
    radius: Size


class BoxSpec(_Spec):
    """A box centred on the origin."""

    type: Literal["box"]
    size: Sizes = Field(description="Width, depth and height: edge lengths along x, y and z.")


class CapsuleSpec(_Spec):
    """A cylinder along z with half balls on its ends."""

    type: Literal["capsule"]
    radius: Size
    length: Size = Field(description="Of the cylinder alone, without its ends.")


class CylinderSpec(_Spec):
    """A cylinder along z, centred on the origin."""

    type: Literal["cylinder"]
    radius: Size
    length: Size


class EllipsoidSpec(_Spec):
    """An ellipsoid with its axes along x, y and z."""

    type: Literal["ellipsoid"]
    semi_axes: Sizes


class HalfSpaceSpec(_Spec):
    """All points with z <= 0."""

    type: Literal["half_space"]


class ConvexSpec(_Spec):
    """The convex hull of points, or of a mesh file."""

    type: Literal["convex"]
    file: Text | None = Field(None, description="Relative to this file, package:// or file://.")
    vertices: Annotated[list[Vertex], Field(min_length=1)] | None = None
    scale: Scale = 1.0

    @model_validator(mode="after")
    def _one_source(self) -> ConvexSpec:
        if (self.file is None) == (self.vertices is None):
            raise ValueError("give file or vertices, and only one of them")
        return self


class MeshSpec(_Spec):
    """A triangle mesh, which need be neither convex nor closed."""

    type: Literal["mesh"]
    file: Text | None = Field(None, description="Relative to this file, package:// or file://.")
    vertices: Annotated[list[Vertex], Field(min_length=3)] | None = None
    faces: Annotated[list[Triangle], Field(min_length=1)] | None = None
    scale: Scale = 1.0

    @model_validator(mode="after")
    def _one_source(self) -> MeshSpec:
        if (self.file is None) == (self.vertices is None):
            raise ValueError("give file, or vertices and faces")
        if (self.vertices is None) != (self.faces is None):
            raise ValueError("vertices and faces come together")
        return self


class PointCloudSpec(_Spec):
    """Balls about points, as a sensor sees them; others are set while the scene runs."""

    type: Literal["point_cloud"]
    radius: Radius | list[Radius] = Field(
        description="Of all balls, or of each: half the sensor's resolution at least."
    )
    points: list[Vertex] = Field([], description="The centres to begin with, none by default.")


class HeightFieldSpec(_Spec):
    """The solid between a grid of heights and a floor; others are set while the scene runs."""

    type: Literal["height_field"]
    heights: Annotated[list[Row], Field(min_length=2)] = Field(
        description="Rows along y, of heights along x, above the frame's xy plane."
    )
    size: Lengths = Field(description="Along x and y.")
    floor: Coordinate = Field(description="z of its underside, below all heights.")


class VoxelGridSpec(_Spec):
    """Boxes that are free, occupied or unknown; others are set while the scene runs."""

    type: Literal["voxel_grid"]
    voxel: Size = Field(description="The edge of a voxel; (0, 0, 0) has a corner at the origin.")
    unknown_is_free: bool = Field(False, description="Whether queries take unknown for free.")
    counts: Annotated[list[Index], Field(min_length=3, max_length=3)] = Field(
        description="Voxels along x, y and z."
    )
    runs: list[Annotated[list[Index], Field(min_length=2, max_length=2)]] = Field(
        description="Pairs of a state, 0 free, 1 occupied, 2 unknown, and how many voxels in turn"
        " have it, z first."
    )


ShapeSpec = Annotated[
    SphereSpec
    | BoxSpec
    | CapsuleSpec
    | CylinderSpec
    | EllipsoidSpec
    | HalfSpaceSpec
    | ConvexSpec
    | MeshSpec
    | PointCloudSpec
    | HeightFieldSpec
    | VoxelGridSpec,
    Field(discriminator="type"),
]
