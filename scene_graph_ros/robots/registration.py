"""Register a robot in a scene graph through its public API."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    Sphere,
)
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.robots.adjacency import adjacent_pairs
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import Link, LinkGeometry, MeshFile
from scene_graph_ros.robots.semantic_model import SemanticModel

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.geometry.model.ids import FrameId, SourceId
    from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["filter_link_pairs", "register_robot", "shape_of"]


def shape_of(geometry: LinkGeometry) -> Shape:
    """Return the core's shape of a link's geometry.

    Raises SceneFileError, naming the place in the file, for a mesh that was not found or a shape
    the core refuses.
    """
    try:
        return _shape(geometry.shape)
    except SceneGraphError as error:
        raise SceneFileError(f"{geometry.location}: {error}") from error


def _shape(shape: object) -> Shape:
    if isinstance(shape, MeshFile):
        if shape.path is None:
            raise SceneFileError(shape.reason)
        return Mesh(shape.path, shape.scale)
    match (shape.kind, shape.size):  # type: ignore[attr-defined]
        case ("box", (x, y, z)):
            return Box(x, y, z)
        case ("sphere", (radius,)):
            return Sphere(radius)
        case ("cylinder", (radius, length)):
            return Cylinder(radius, length)
        case ("capsule", (radius, length)):
            return Capsule(radius, length)
        case ("ellipsoid", (a, b, c)):
            return Ellipsoid(a, b, c)
    raise AssertionError(f"the reader let {shape!r} through")


def register_robot(
    robot: RobotModel,
    scene_graph: SceneGraph,
    source_id: SourceId,
    *,
    prefix: str = "",
    parent: FrameId | None = None,
    semantics: SemanticModel | None = None,
    filter_adjacent: bool = False,
    collision: bool = True,
    visual: bool = True,
    all_links: bool = False,
    proximity: ProximityProperties | None = None,
    perception: PerceptionProperties | None = None,
) -> dict[str, FrameId]:
    """Register a frame for each link with geometry, and the geometry; return frames by link.

    Collision geometry gets the proximity role (with a copy of ``proximity``), visual geometry the
    illustration role and, with a copy of ``perception`` where that is given, the perception role,
    both in its own colour unless ``perception`` has one. Frames are called ``prefix + link`` and
    are children of ``parent``, or of the world: set their poses from Kinematics. ``all_links``
    makes frames of links without geometry, too. Without ``semantics`` nothing is filtered, as in
    MoveIt; ``filter_adjacent`` excludes the pairs of ``adjacent_pairs``.

    Raises SceneFileError for a mesh that cannot be read, and the scene graph's errors.
    """
    frames: dict[str, FrameId] = {}
    for link in robot.links.values():
        shown = visual and link.visuals
        solid = collision and link.collisions
        if not (shown or solid or all_links):
            continue
        frame = GeometryFrame(prefix + link.name)
        if parent is None:
            frames[link.name] = scene_graph.register_frame(source_id, frame)
        else:
            frames[link.name] = scene_graph.register_frame(source_id, frame, parent=parent)
        for instance in _instances(link, bool(solid), bool(shown), prefix, proximity, perception):
            scene_graph.register_geometry(source_id, frames[link.name], instance)
    pairs = set() if semantics is None else semantics.filtered_pairs(robot.links)
    if filter_adjacent:
        pairs |= adjacent_pairs(robot)
    filter_link_pairs(scene_graph, frames, pairs)
    return frames


def _instances(
    link: Link,
    collision: bool,
    visual: bool,
    prefix: str,
    proximity: ProximityProperties | None,
    perception: PerceptionProperties | None,
) -> Iterator[GeometryInstance]:
    for geometry in link.collisions if collision else ():
        instance = GeometryInstance(geometry.X_LG, shape_of(geometry), prefix + geometry.name)
        instance.set_proximity_properties(proximity or ProximityProperties())
        yield instance
    for geometry in link.visuals if visual else ():
        instance = GeometryInstance(geometry.X_LG, shape_of(geometry), prefix + geometry.name)
        shown = IllustrationProperties()
        seen = None if perception is None else perception.copy()
        for properties in (shown, seen):
            if properties is None or geometry.rgba is None:
                continue
            if not properties.has_property("phong", "diffuse"):
                properties.add_property("phong", "diffuse", Rgba(*geometry.rgba))
        instance.set_illustration_properties(shown)
        if seen is not None:
            instance.set_perception_properties(seen)
        yield instance


def filter_link_pairs(
    scene_graph: SceneGraph, frames: Mapping[str, FrameId], pairs: set[tuple[str, str]]
) -> None:
    """Exclude collisions between the geometry of pairs of links, for good.

    Links without a frame in ``frames`` have no geometry, so their pairs are left out.
    """
    partners: dict[str, list[FrameId]] = {}
    for link_A, link_B in sorted(pairs):
        if link_A in frames and link_B in frames:
            partners.setdefault(link_A, []).append(frames[link_B])
    declaration = CollisionFilterDeclaration()
    for link, others in partners.items():
        declaration.exclude_between(GeometrySet(frames[link]), GeometrySet(others))
    if partners:
        scene_graph.collision_filter_manager().apply(declaration)
