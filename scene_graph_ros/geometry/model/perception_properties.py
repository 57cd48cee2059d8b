"""What a geometry's properties say about how cameras see it, read and checked as a whole."""

from __future__ import annotations

from collections.abc import Set
from typing import Any, NamedTuple

from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.meshes.sources import hull_of, load_surface
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["Appearance", "read_perception_properties", "read_visible_mesh"]

_LABELS = (RenderLabel.DONT_CARE, RenderLabel.DO_NOT_RENDER)


class Appearance(NamedTuple):
    """The perception properties of one geometry."""

    diffuse: Rgba | None
    """None: what the file of a mesh says, else the renderer's default."""
    label: RenderLabel
    accepting: frozenset[str]
    """The names of the renderers that draw the geometry; all do if there are none."""


def read_perception_properties(properties: GeometryProperties, name: str) -> Appearance:
    """Return how a geometry called ``name`` looks.

    Raises PropertyError, naming geometry, property and value, for one that has no meaning.
    """
    try:
        label = _label(properties)
        diffuse = properties.get_property_or_default("phong", "diffuse", None)
        if properties.has_property("phong", "diffuse_map"):
            raise PropertyError("('phong', 'diffuse_map'): no renderer draws textures yet")
        return Appearance(
            diffuse=None if diffuse is None else Rgba.from_value(diffuse),
            label=label,
            accepting=_accepting(properties),
        )
    except PropertyError as error:
        raise PropertyError(f"perception properties of geometry {name!r}: {error}") from error


def _label(properties: GeometryProperties) -> RenderLabel:
    value = properties.get_property_or_default("label", "id", None)
    if value is None:
        return RenderLabel.DONT_CARE
    label = RenderLabel(value)
    if label.is_reserved() and label not in _LABELS:
        raise PropertyError(f"('label', 'id') is {label!r}, which no geometry can have")
    return label


def _accepting(properties: GeometryProperties) -> frozenset[str]:
    value = properties.get_property_or_default("renderer", "accepting", None)
    if value is None:
        return frozenset()
    is_list = isinstance(value, (Set, list, tuple))
    if not is_list or not all(isinstance(name, str) for name in value):
        raise PropertyError(
            f"('renderer', 'accepting') must be a set of renderers' names, not {quoted(value)}"
        )
    return frozenset(value)


def read_visible_mesh(shape: Any, properties: GeometryProperties) -> None:
    """Read and keep what cameras see of a Convex or Mesh; other shapes have no data.

    The colours of its file are read where the ``properties`` have none.

    This may take long, so it is called before a model is locked for a change. Raises MeshError.
    """
    if isinstance(shape, MeshShape):
        if shape.kind == ShapeKind.CONVEX:
            hull_of(shape)
        else:
            load_surface(shape)
            if not properties.has_property("phong", "diffuse"):
                triangle_colors(shape)
