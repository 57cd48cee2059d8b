"""The part of the scene files' schema that describes renderers."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

__all__ = [
    "ExactRendererSpec",
    "GltfClientSpec",
    "LightSpec",
    "RendererSpec",
    "TracedRendererSpec",
]

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Channel = Annotated[Number, Field(ge=0.0, le=1.0)]
Color = Annotated[list[Channel], Field(min_length=3, max_length=4)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Text = Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1)]
Whole = Annotated[int, Field(strict=True, ge=0)]


class _Spec(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _RendererSpec(_Spec):
    name: Text = Field(description="What cameras call it.")


class _OwnRendererSpec(_RendererSpec):
    default_diffuse: Color | None = Field(
        None, description="Of geometries without a colour, 0 to 1; default: 0.9, 0.7, 0.2."
    )
    default_clear_color: Color | None = Field(
        None, description="Of pixels that see nothing; default: 0.8, 0.898, 1."
    )


class ExactRendererSpec(_OwnRendererSpec):
    """Depth, label and colour by the equations of shapes, lit along the camera's axis."""

    type: Literal["exact"]


class LightSpec(_Spec):
    """A light: of intensity 1, it lights a white surface that faces it to full white."""

    type: Literal["directional", "point", "spot"] = "directional"
    color: Color = [1.0, 1.0, 1.0]
    intensity: Annotated[Number, Field(ge=0.0)] = Field(
        1.0, description="At 1 m for points and spots, which fall off with the distance squared."
    )
    position: Vector = Field([0.0, 0.0, 0.0], description="Of points and spots, metres.")
    direction: Vector = Field([0.0, 0.0, 1.0], description="In which light goes.")
    frame: Literal["world", "camera"] = Field("camera", description="Of position and direction.")
    cone_angle: Annotated[Number, Field(gt=0.0, le=0.5 * math.pi)] = Field(
        0.5, description="Of a spot, from its direction to its edge, radians."
    )


class TracedRendererSpec(_OwnRendererSpec):
    """Colour with light and shadows, by Mitsuba; depth and label as exact has them."""

    type: Literal["traced"]
    lights: list[LightSpec] | None = Field(
        None, description="Default: one from over the camera's left shoulder."
    )
    ambient: Annotated[Number, Field(ge=0.0)] = Field(0.2, description="Light from all sides.")
    samples: Annotated[Whole, Field(ge=1)] = Field(16, description="Paths per pixel.")
    max_depth: Annotated[Whole, Field(ge=2)] = Field(
        3, description="Surfaces and lights on a path; 2: direct light alone."
    )
    seed: Whole = Field(0, description="The same one gives the same image.")


class GltfClientSpec(_RendererSpec):
    """Images by a render server, which is sent the scene as glTF."""

    type: Literal["gltf_client"]
    base_url: Text = Field("http://127.0.0.1:8000", description="Of the server.")
    render_endpoint: Text = Field("render", description="Below base_url.")
    verbose: Annotated[bool, Field(strict=True)] = Field(False, description="Log each question.")
    cleanup: Annotated[bool, Field(strict=True)] = Field(
        True, description="false: keep each question and answer in a folder."
    )
    timeout: Annotated[Number, Field(gt=0.0)] = Field(60.0, description="Of an image, seconds.")
    default_diffuse: Color | None = Field(
        None, description="Of geometries without a colour, 0 to 1; default: 0.9, 0.7, 0.2."
    )


RendererSpec = Annotated[
    ExactRendererSpec | TracedRendererSpec | GltfClientSpec,
    Field(discriminator="type"),
]
