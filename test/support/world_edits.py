"""Every way to edit a scene graph or a context: each an action on a small world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from edited_worlds import at, Renderer, TETRAHEDRON, World
from soft_bodies import soft_instance, WORLD

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    CollisionFilterDeclaration,
    Convex,
    DefaultProximityProperties,
    GeometryFrame,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
    Rgba,
    Role,
    RoleAssign,
    SceneGraphConfig,
    Sphere,
)

__all__ = ["EDITS", "EDITS_OF_POSES", "PREPARATIONS", "Edit"]


def _coloured() -> IllustrationProperties:
    result = IllustrationProperties()
    result.add_property("phong", "diffuse", Rgba(1, 0, 0, 1))
    return result


def _soft() -> ProximityProperties:
    result = ProximityProperties()
    add_compliant_hydroelastic_properties(result, 0.1, 1e5)
    return result


def _rigid() -> ProximityProperties:
    result = ProximityProperties()
    add_rigid_hydroelastic_properties(result, 0.1)
    return result


def _triangles() -> ProximityProperties:
    result = ProximityProperties()
    result.add_property("mesh", "representation", "triangles")
    return result


def _declare(world: World) -> None:
    declaration = CollisionFilterDeclaration()
    declaration.exclude_within(world.set_of("egg", "mesh", "box", "floor"))
    declaration.allow_between(world.set_of("ball"), world.set_of("rod"))
    world.graph.collision_filter_manager(world.target).apply(declaration)


def _exclude(world: World) -> None:
    world.graph.exclude_collisions_between(
        world.set_of("egg"), world.set_of("hull"), context=world.target
    )


def _exclude_for_now(world: World) -> None:
    declaration = CollisionFilterDeclaration()
    declaration.exclude_between(world.set_of("can", "egg"), world.set_of("box"))
    manager = world.graph.collision_filter_manager(world.target)
    world.filter_id = manager.apply_transient(declaration)


_FRICTION = SceneGraphConfig(
    default_proximity_properties=DefaultProximityProperties(
        static_friction=0.5, dynamic_friction=0.5
    )
)


def _several(world: World) -> None:
    """Make three changes that count together."""

    def change() -> None:
        graph, to = world.graph, world.target
        source = graph.register_source("new", context=to)
        graph.register_frame(source, GeometryFrame("new"), context=to)
        graph.change_shape(world.arm, world.ids["ball"], Box(0.5, 0.4, 0.3), context=to)

    world.graph.all_or_nothing(change, context=world.target)


Edit = Callable[[World], Any]

PREPARATIONS: dict[str, Edit] = {"remove transient": _exclude_for_now}
"""What is done to a world before an edit, which is one change, can be made."""

EDITS: dict[str, Edit] = {
    "register source": lambda w: w.graph.register_source("new", context=w.target),
    "remove source": lambda w: w.graph.remove_source(w.other, context=w.target),
    "register frame": lambda w: w.graph.register_frame(
        w.arm, GeometryFrame("new"), parent=w.frames["link1"], context=w.target
    ),
    "remove frame": lambda w: w.graph.remove_frame(w.arm, w.frames["link1"], context=w.target),
    "rename frame": lambda w: w.graph.rename_frame(
        w.arm, w.frames["link1"], "elbow", context=w.target
    ),
    "change parent": lambda w: w.graph.change_parent(
        w.other, w.frames["crate"], w.frames["link2"], context=w.target
    ),
    "register geometry": lambda w: w.graph.register_geometry(
        w.arm, w.frames["link2"], w.instance("new", at(0.1, 0, 0), Sphere(0.3)), context=w.target
    ),
    "register hanging geometry": lambda w: w.graph.register_geometry(
        w.arm, w.ids["ball"], w.instance("new", at(0.1, 0, 0), Box(1, 1, 1)), context=w.target
    ),
    "register anchored geometry": lambda w: w.graph.register_anchored_geometry(
        w.other, w.instance("wall", at(0.3, 0, 0), Box(0.1, 1, 1)), context=w.target
    ),
    "register deformable geometry": lambda w: w.graph.register_deformable_geometry(
        w.arm, WORLD, soft_instance("soft", Box(0.1, 0.1, 0.1)), 0.1, context=w.target
    ),
    "remove geometry": lambda w: w.graph.remove_geometry(w.other, w.ids["box"], context=w.target),
    "rename geometry": lambda w: w.graph.rename_geometry(
        w.arm, w.ids["rod"], "stick", context=w.target
    ),
    "assign proximity": lambda w: w.graph.assign_role(
        w.arm, w.ids["picture"], ProximityProperties(), context=w.target
    ),
    "assign illustration": lambda w: w.graph.assign_role(
        w.arm, w.ids["ball"], _coloured(), context=w.target
    ),
    "assign perception": lambda w: w.graph.assign_role(
        w.arm, w.ids["ball"], PerceptionProperties(), context=w.target
    ),
    "replace properties": lambda w: w.graph.assign_role(
        w.arm, w.ids["mesh"], _triangles(), RoleAssign.REPLACE, context=w.target
    ),
    "make compliant": lambda w: w.graph.assign_role(
        w.arm, w.ids["ball"], _soft(), RoleAssign.REPLACE, context=w.target
    ),
    "make rigid": lambda w: w.graph.assign_role(
        w.other, w.ids["box"], _rigid(), RoleAssign.REPLACE, context=w.target
    ),
    "remove role": lambda w: w.graph.remove_role(
        w.arm, w.ids["rod"], Role.PROXIMITY, context=w.target
    ),
    "remove roles of a frame": lambda w: w.graph.remove_role(
        w.other, w.frames["crate"], Role.PROXIMITY, context=w.target
    ),
    "change shape": lambda w: w.graph.change_shape(
        w.arm, w.ids["ball"], Box(0.5, 0.4, 0.3), context=w.target
    ),
    "change shape and pose": lambda w: w.graph.change_shape(
        w.other, w.ids["box"], Sphere(0.3), at(0.05, 0.1, 0.2, 1.0), context=w.target
    ),
    "change mesh": lambda w: w.graph.change_shape(
        w.arm, w.ids["hull"], Convex(vertices=1.5 * TETRAHEDRON), context=w.target
    ),
    "declare filters": _declare,
    "exclude a pair": _exclude,
    "exclude within": lambda w: w.graph.exclude_collisions_within(
        w.set_of("egg", "box", "can"), context=w.target
    ),
    "several changes": _several,
    "apply transient": _exclude_for_now,
    "remove transient": lambda w: w.graph.collision_filter_manager(w.target).remove_declaration(
        w.filter_id
    ),
    "flatten filters": lambda w: w.graph.collision_filter_manager(w.target).flatten(),
    "add renderer": lambda w: w.graph.add_renderer("new", Renderer(), context=w.target),
    "remove renderer": lambda w: w.graph.remove_renderer("first", context=w.target),
    "set accuracy": lambda w: w.graph.set_accuracy("quick", context=w.target),
    "set engine": lambda w: w.graph.set_engine("native", context=w.target),
    "set configuration": lambda w: w.graph.set_config(_FRICTION, context=w.target),
}

EDITS_OF_POSES: dict[str, Edit] = {
    "set all poses": lambda w: w.context.set_frame_poses(w.arm, w.poses(0.03)),
    "set some poses": lambda w: w.context.set_frame_poses(
        w.arm, {w.frames["link1"]: at(0.2, 0.1, 0, 1), w.frames["tool"]: at(0.3, 0, 0.1, 2)}
    ),
    "set a pose": lambda w: w.context.set_frame_pose(w.other, w.frames["crate"], at(0.1, 0, 0)),
    "set configurations": lambda w: w.context.set_configurations(
        w.arm, {w.ids["pad"]: 1.1 * w.context.configuration(w.ids["pad"])}
    ),
    "set points": lambda w: w.context.set_points(
        w.other, {w.ids["seen"]: [[0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]}
    ),
    "set heights": lambda w: w.context.set_heights(
        w.other, {w.ids["ground"]: [[0.2, 0.1], [0.3, 0.1]]}
    ),
    "set voxels": lambda w: w.context.set_voxels(
        w.other, {w.ids["map"]: [[[0, 1], [1, 1]], [[0, 0], [1, 2]]]}
    ),
}
