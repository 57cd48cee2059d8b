"""Drawings of the geometries with a role: names, shapes and colours."""

from __future__ import annotations

from collections.abc import Iterable

from scene_graph_ros.geometry.model.contact_properties import uses_triangles
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.perception_properties import picture_of
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.views.draw_list import DrawItem

__all__ = ["DEFAULT_COLOR", "PROXIMITY_COLOR", "draw_items"]

PROXIMITY_COLOR = Rgba(0.9, 0.45, 0.1, 0.5)
"""Of collision geometry without a colour: see-through, so that what it covers stays visible."""

DEFAULT_COLOR = Rgba(0.7, 0.7, 0.7, 1.0)
"""Of what has no colour and no file with materials of its own."""


def draw_items(
    inspector: SceneGraphInspector,
    role: Role,
    geometry_ids: Iterable[GeometryId],
    *,
    mesh_hulls: bool = False,
) -> list[DrawItem]:
    """Return the drawings of geometries with ``role``, in their order.

    The colour is the role's property ("phong", "diffuse"). Without one, collision geometry gets
    PROXIMITY_COLOR, the rest the materials of its mesh file. ``mesh_hulls`` draws the convex hull
    of each collision Mesh that is not said to mean its triangles; one in pieces is always drawn as
    their hulls. Raises UnknownIdError for a
    geometry that is not there, PropertyError for a colour or a picture that is none.
    """
    return [_item(inspector, role, geometry_id, mesh_hulls) for geometry_id in geometry_ids]


def _item(
    inspector: SceneGraphInspector, role: Role, geometry_id: GeometryId, mesh_hulls: bool
) -> DrawItem:
    properties = inspector.get_properties(geometry_id, role)
    assert properties is not None, f"{geometry_id} has the role {role}"
    shape = inspector.get_shape(geometry_id)
    rgba = properties.get_property_or_default("phong", "diffuse", None)
    if rgba is not None:
        rgba = Rgba.from_value(rgba)
    elif role is Role.PROXIMITY:
        rgba = PROXIMITY_COLOR
    if isinstance(shape, MeshShape) and role is not Role.PROXIMITY:
        shape = shape.with_pieces(None)  # they are collision's
    means_hull = (
        mesh_hulls
        and isinstance(properties, ProximityProperties)
        and shape.kind == ShapeKind.MESH
        and not uses_triangles(properties)
    )
    source = inspector.get_owning_source_name(geometry_id)
    frame = inspector.get_name(inspector.get_frame_id(geometry_id))
    path = (role.name.lower(), source, frame, inspector.get_name(geometry_id))
    picture = None if role is Role.PROXIMITY else picture_of(properties)
    return DrawItem(int(geometry_id), "/".join(path[:3]), shape, rgba, means_hull, path, picture)
