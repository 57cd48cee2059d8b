"""The look of a geometry by its properties, for cameras and people; read and checked."""

from __future__ import annotations

from collections.abc import Set
import math
from pathlib import Path
from typing import Any, NamedTuple

from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.meshes.sources import hull_of, load_surface
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates
from scene_graph_ros.geometry.meshes.textures import place_of, read_texture
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = [
    "Appearance",
    "Picture",
    "check_appearance",
    "check_illustration",
    "picture_of",
    "read_perception_properties",
]

_LABELS = (RenderLabel.DONT_CARE, RenderLabel.DO_NOT_RENDER)
_MAX_SCALE = 1e6
"""Of texture coordinates: more repetitions than that are a mistake."""


class Picture(NamedTuple):
    """The picture that covers a geometry."""

    path: str
    """An image file."""
    scale: tuple[float, float]
    """Factors of texture coordinates: how often it is repeated along each."""


class Appearance(NamedTuple):
    """The perception properties of one geometry."""

    diffuse: Rgba | None
    """None: what the file of a mesh says, else the renderer's default; white below a picture."""
    picture: Picture | None
    label: RenderLabel
    accepting: frozenset[str]
    """The names of the renderers that draw the geometry; all do if there are none."""

    @property
    def is_of_file(self) -> bool:
        """Whether a mesh looks as its file says."""
        return self.diffuse is None and self.picture is None


def read_perception_properties(properties: GeometryProperties, name: str) -> Appearance:
    """Return the look of a geometry called ``name``.

    Raises PropertyError, naming geometry, property and value, for one that has no meaning.
    """
    try:
        label = _label(properties)
        diffuse = properties.get_property_or_default("phong", "diffuse", None)
        return Appearance(
            diffuse=None if diffuse is None else Rgba.from_value(diffuse),
            picture=picture_of(properties),
            label=label,
            accepting=_accepting(properties),
        )
    except PropertyError as error:
        raise PropertyValueError(f"perception properties of geometry {name!r}: {error}") from error


def _label(properties: GeometryProperties) -> RenderLabel:
    value = properties.get_property_or_default("label", "id", None)
    if value is None:
        return RenderLabel.DONT_CARE
    label = RenderLabel(value)
    if label.is_reserved() and label not in _LABELS:
        raise PropertyValueError(f"('label', 'id') is {label!r}, which no geometry can have")
    return label


def _accepting(properties: GeometryProperties) -> frozenset[str]:
    value = properties.get_property_or_default("renderer", "accepting", None)
    if value is None:
        return frozenset()
    is_list = isinstance(value, (Set, list, tuple))
    if not is_list or not all(isinstance(name, str) for name in value):
        raise PropertyValueError(
            f"('renderer', 'accepting') must be a set of renderers' names, not {quoted(value)}"
        )
    return frozenset(value)


def picture_of(properties: GeometryProperties) -> Picture | None:
    """Return the picture that covers a geometry, None without one. Raises PropertyError."""
    path = properties.get_property_or_default("phong", "diffuse_map", None)
    if path is None:
        if properties.has_property("phong", "diffuse_scale"):
            raise PropertyValueError(
                "('phong', 'diffuse_scale') comes with ('phong', 'diffuse_map')"
            )
        return None
    if not isinstance(path, (str, Path)) or not str(path):
        raise PropertyValueError(
            f"('phong', 'diffuse_map') must be the path of an image file, not {quoted(path)}"
        )
    scale = properties.get_property_or_default("phong", "diffuse_scale", None)
    try:
        factors = [1.0, 1.0] if scale is None else [as_float(factor) for factor in scale]
    except TypeError:
        factors = []
    numbers = [f for f in factors if f is not None and math.isfinite(f)]
    if not (len(numbers) == len(factors) == 2 and all(0 < abs(f) <= _MAX_SCALE for f in numbers)):
        raise PropertyValueError(
            "('phong', 'diffuse_scale') must be two numbers that are not 0, of at most"
            f" {_MAX_SCALE:g}, not {quoted(scale)}"
        )
    return Picture(place_of(path), (numbers[0], numbers[1]))


def check_appearance(
    shape: Any, properties: GeometryProperties, name: str, *, deforms: bool = False
) -> None:
    """Read and keep a geometry's look for cameras: a mesh, its colours, the pictures on it.

    The colours and pictures of a mesh's file are read where the ``properties`` have none.

    This may take long, so it is called before a model is locked for a change. Raises MeshError for
    a mesh, PropertyError for properties without a meaning, for a picture that is missing or
    unreadable, and for one on something that has no texture coordinates.
    """
    if isinstance(shape, MeshShape) and not deforms:
        if shape.kind == ShapeKind.CONVEX:
            hull_of(shape)
        else:
            load_surface(shape)
    look = read_perception_properties(properties, name)
    if look.picture is None:
        if isinstance(shape, MeshShape) and not deforms and look.is_of_file:
            triangle_colors(shape)
            triangle_pictures(shape)
        return
    try:
        _check_picture(shape, look.picture, deforms=deforms)
    except PropertyError as error:
        raise PropertyValueError(f"perception properties of geometry {name!r}: {error}") from error


def check_illustration(
    shape: Any, properties: GeometryProperties, name: str, *, deforms: bool = False
) -> None:
    """Read and keep the picture on a geometry that people see, if it has one.

    Raises PropertyError as ``check_appearance`` does for pictures.
    """
    try:
        picture = picture_of(properties)
        if picture is not None:
            _check_picture(shape, picture, deforms=deforms)
    except PropertyError as error:
        raise PropertyValueError(
            f"illustration properties of geometry {name!r}: {error}"
        ) from error


def _check_picture(shape: Any, picture: Picture, *, deforms: bool) -> None:
    try:
        if deforms:
            raise MeshError("deformable geometry has no texture coordinates")
        read_texture(picture.path)
        if isinstance(shape, MeshShape):
            texture_coordinates(shape)
    except MeshError as error:
        raise PropertyValueError(f"('phong', 'diffuse_map'): {error}") from error
