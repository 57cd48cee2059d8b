"""The geometry core: shapes, the scene graph and the queries, without ROS.

Shapes and properties describe things, ``SceneGraph`` their places, and a query object
answers how near, how deep and in contact with what. Conventions are in ``docs/conventions.md``.
"""

import importlib
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.compile_progress import show_compilation
from scene_graph_ros.geometry.meshes.surface_mesh import read_obj_to_surface_mesh, SurfaceMesh
from scene_graph_ros.geometry.model.collision_filter import (
    CollisionFilterDeclaration,
    CollisionFilterScope,
)
from scene_graph_ros.geometry.model.contact_properties import (
    add_compliant_hydroelastic_properties,
    add_compliant_hydroelastic_properties_for_half_space,
    add_contact_material,
    add_rigid_hydroelastic_properties,
)
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FilterId, FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.model.properties import (
    IllustrationProperties,
    make_phong_illustration_properties,
    PerceptionProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role, RoleAssign
from scene_graph_ros.geometry.model.scene_config import (
    DefaultProximityProperties,
    SceneGraphConfig,
)
from scene_graph_ros.geometry.model.scene_graph import SceneGraph
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.representation import ContactRepresentation
from scene_graph_ros.geometry.query.results import (
    PenetrationAsPointPair,
    SignedDistancePair,
    SignedDistanceToPoint,
)
from scene_graph_ros.geometry.query.what_if import ask_what_if
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel, VoxelGrid

if TYPE_CHECKING:
    from scene_graph_ros.geometry.deformable.results import (
        ContactParticipation as ContactParticipation,
    )
    from scene_graph_ros.geometry.deformable.results import (
        DeformableContact as DeformableContact,
    )
    from scene_graph_ros.geometry.deformable.results import (
        DeformableContactSurface as DeformableContactSurface,
    )
    from scene_graph_ros.geometry.hydroelastic.contact_surface import (
        ContactSurface as ContactSurface,
    )
    from scene_graph_ros.geometry.hydroelastic.contact_surface import (
        ContactSurfaces as ContactSurfaces,
    )
    from scene_graph_ros.geometry.meshes.inflated_hull import make_convex_hull as make_convex_hull
    from scene_graph_ros.geometry.meshes.volume_io import load_volume_mesh as load_volume_mesh
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh as VolumeMesh

__all__ = [
    "Box",
    "Capsule",
    "CollisionFilterDeclaration",
    "CollisionFilterScope",
    "ContactRepresentation",
    "Context",
    "Convex",
    "Cylinder",
    "DefaultProximityProperties",
    "Ellipsoid",
    "FilterId",
    "FrameId",
    "GeometryFrame",
    "GeometryId",
    "GeometryInstance",
    "GeometryPair",
    "GeometrySet",
    "HalfSpace",
    "HeightField",
    "IllustrationProperties",
    "Mesh",
    "PenetrationAsPointPair",
    "PerceptionProperties",
    "PointCloud",
    "ProximityProperties",
    "QueryObject",
    "Rgba",
    "Role",
    "RoleAssign",
    "SceneGraph",
    "SceneGraphConfig",
    "SceneGraphInspector",
    "Shape",
    "SignedDistancePair",
    "SignedDistanceToPoint",
    "SourceId",
    "Sphere",
    "SurfaceMesh",
    "Voxel",
    "VoxelGrid",
    "add_compliant_hydroelastic_properties",
    "add_compliant_hydroelastic_properties_for_half_space",
    "add_contact_material",
    "add_rigid_hydroelastic_properties",
    "ask_what_if",
    "make_phong_illustration_properties",
    "read_obj_to_surface_mesh",
]

_ON_DEMAND = {
    "ContactParticipation": "deformable.results",
    "ContactSurface": "hydroelastic.contact_surface",
    "ContactSurfaces": "hydroelastic.contact_surface",
    "DeformableContact": "deformable.results",
    "DeformableContactSurface": "deformable.results",
    "VolumeMesh": "meshes.volume_mesh",
    "load_volume_mesh": "meshes.volume_io",
    "make_convex_hull": "meshes.inflated_hull",
}
"""More public names: results of queries whose code is imported when they are first asked, and
what they are about. ``import *`` leaves them out, since it would import all of that."""

# The model makes query objects, and they are above it.
SceneGraph.provide_queries(QueryObject)
show_compilation()


def __getattr__(name: str) -> Any:
    """Import a name of _ON_DEMAND."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_ON_DEMAND[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_ON_DEMAND]
