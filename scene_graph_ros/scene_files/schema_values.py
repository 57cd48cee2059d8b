"""Values that scene files are made of: numbers, names, topics and poses."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator, StringConstraints

from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = [
    "Channel",
    "Coordinate",
    "Name",
    "Number",
    "PoseSpec",
    "Positive",
    "Reference",
    "Row",
    "Spec",
    "Text",
]

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Coordinate = Annotated[Number, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]
Row = Annotated[list[Number], Field(min_length=4, max_length=4)]
Channel = Annotated[Number, Field(ge=0.0, le=1.0)]
Name = Annotated[
    str, StringConstraints(strict=True, strip_whitespace=True, min_length=1, pattern=r"^[^/]*$")
]
Text = Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1)]
Reference = Text
Positive = Annotated[Number, Field(gt=0.0)]


class Spec(BaseModel):
    """A part of a scene file: it has the keys that it names, and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PoseSpec(Spec):
    """A pose: a position, and fixed-axis angles or a quaternion; or a matrix, without loss."""

    xyz: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]
    rpy: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = Field(
        None, description="Roll, pitch and yaw in radians: Rz(yaw) Ry(pitch) Rx(roll)."
    )
    quaternion: Annotated[list[Number], Field(min_length=4, max_length=4)] | None = Field(
        None, description="Unit quaternion in the order x, y, z, w."
    )

    matrix: Annotated[list[Row], Field(min_length=3, max_length=4)] | None = Field(
        None, description="The pose (4, 4) in place of all else; its last row may be left out."
    )

    @model_validator(mode="after")
    def _one_rotation(self) -> PoseSpec:
        if self.matrix is not None and self.model_fields_set & {"xyz", "rpy", "quaternion"}:
            raise ValueError("give matrix, or xyz with rpy or quaternion, not both")
        if self.matrix is not None and self.matrix[3:] not in ([], [[0.0, 0.0, 0.0, 1.0]]):
            raise ValueError(f"the last row of matrix must be 0, 0, 0, 1, got {self.matrix[3]}")
        if self.rpy is not None and self.quaternion is not None:
            raise ValueError("give rpy or quaternion, not both")
        return self
