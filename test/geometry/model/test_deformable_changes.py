"""Deformable geometries in contexts and snapshots, filters and rigid queries; their removal."""

import numpy as np
import pytest
from soft_bodies import other_configuration, soft_instance, WORLD

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    CollisionFilterScope,
    Context,
    GeometrySet,
    ProximityProperties,
    Role,
    RoleAssign,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    DeformableError,
    RoleError,
    UnknownIdError,
)


def test_snapshots_never_change(world, pad):
    """A snapshot keeps its configurations; poses and configurations change independently."""
    context = world.scene_graph.create_default_context()
    first = context.snapshot
    start = first.configuration(pad).q_WG
    q_WG = other_configuration(context, pad)
    context.set_configurations(world.arm, {pad: q_WG})
    second = context.snapshot
    context.set_frame_pose(world.arm, world.link1, world.translation(x=1.0))
    third = context.snapshot
    assert second.pose_version > first.pose_version
    assert np.array_equal(first.configuration(pad).q_WG, start)
    assert third.configuration(pad) is second.configuration(pad)
    what_if = third.with_frame_poses({world.link1: np.eye(4)})
    assert what_if.configuration(pad) is third.configuration(pad)
    context.set_configurations(world.arm, {})
    assert context.snapshot is third


def test_contexts_are_independent(world, pad):
    """A clone begins with the same configuration; then each has its own."""
    a = world.scene_graph.create_default_context()
    start = a.configuration(pad)
    q_WG = other_configuration(a, pad)
    a.set_configurations(world.arm, {pad: q_WG})
    b = a.clone()
    fresh = world.scene_graph.create_default_context()
    b.set_configurations(world.arm, {pad: 3.0 * q_WG})
    assert np.array_equal(a.configuration(pad), q_WG)
    assert np.array_equal(b.configuration(pad), 3.0 * q_WG)
    assert np.array_equal(fresh.configuration(pad), start)


def test_registered_in_a_context_alone(world):
    """Neither the scene graph nor another context knows it."""
    context, other = (world.scene_graph.create_default_context() for _ in range(2))
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(), 0.2, context=context
    )
    assert context.inspector().is_deformable(soft)
    for inspector in (world.inspector, other.inspector()):
        with pytest.raises(UnknownIdError):
            inspector.is_deformable(soft)


def test_removal(world, pad):
    """Removed from the model, it stays in contexts that exist, with what was set."""
    context = world.scene_graph.create_default_context()
    q_WG = other_configuration(context, pad)
    context.set_configurations(world.arm, {pad: q_WG})
    snapshot = context.snapshot
    world.scene_graph.remove_geometry(world.arm, pad)
    assert world.inspector.num_deformable_geometries() == 0
    assert np.array_equal(context.configuration(pad), q_WG)
    world.scene_graph.remove_geometry(world.arm, pad, context=context)
    with pytest.raises(UnknownIdError):
        context.configuration(pad)
    assert np.array_equal(snapshot.configuration(pad).q_WG, q_WG)


def test_removal_with_its_source(world, pad):
    """It goes with its source, and its name is free again."""
    world.scene_graph.remove_source(world.arm)
    assert world.inspector.num_deformable_geometries() == 0
    world.scene_graph.register_deformable_geometry(world.other, WORLD, soft_instance(), 0.2)


def test_registered_anew_under_its_id(world):
    """The same instance registered again is a new body: the old configuration is forgotten."""
    graph, instance = world.scene_graph, soft_instance()
    context = graph.create_default_context()
    pad = graph.register_deformable_geometry(world.arm, WORLD, instance, 0.2, context=context)
    context.set_configurations(world.arm, {pad: other_configuration(context, pad)})
    graph.remove_geometry(world.arm, pad, context=context)
    again = graph.register_deformable_geometry(world.arm, WORLD, instance, 0.1, context=context)
    assert again == pad
    mesh = context.inspector().get_reference_mesh(pad)
    assert np.array_equal(context.configuration(pad), mesh.vertices)


def test_forgotten_configurations_are_let_go(world, pad):
    """A context that lives long keeps nothing of geometries that are gone."""
    context: Context = world.scene_graph.create_default_context()
    q_WG = context.configuration(pad).copy()
    for k in range(3):
        soft = world.scene_graph.register_deformable_geometry(
            world.arm, WORLD, soft_instance(f"pad_{k}"), 0.2, context=context
        )
        context.set_configurations(world.arm, {soft: q_WG})
        world.scene_graph.remove_geometry(world.arm, soft, context=context)
    context.set_configurations(world.arm, {pad: q_WG})
    assert list(context._moment[0].configurations) == [pad]


def test_clone_of_an_instance(world, pad):
    """The clone has shape, pose and roles; with the reference mesh it is the same body again."""
    clone = world.inspector.clone_geometry_instance(pad)
    clone.set_name("copy")
    mesh = world.inspector.get_reference_mesh(pad)
    copy = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, clone, reference_mesh=mesh
    )
    assert copy != pad
    context = world.scene_graph.create_default_context()
    assert np.array_equal(context.configuration(copy), context.configuration(pad))


def test_shape_and_pose_are_fixed(world, pad):
    """Its shape cannot be changed, and it has no pose in the world."""
    with pytest.raises(DeformableError, match=r"'pad'.*reference mesh"):
        world.scene_graph.change_shape(world.arm, pad, Sphere(1.0))
    query = world.scene_graph.query_object(world.scene_graph.create_default_context())
    with pytest.raises(DeformableError, match=r"'pad'.*configuration"):
        query.get_pose_in_world(pad)
    world.scene_graph.rename_geometry(world.arm, pad, "cushion")
    assert world.inspector.get_name(pad) == "cushion"


def test_rigid_queries_leave_it_out(world, pad):
    """In the middle of a ball, and of a point, it is not reported by any of them."""
    graph = world.scene_graph
    context = graph.create_default_context()
    mean = context.configuration(pad).mean(axis=0)
    context.set_configurations(world.arm, {pad: context.configuration(pad) - mean})
    query = graph.query_object(context)
    assert len(query.compute_deformable_contact()) > 0
    assert int(pad) not in query.snapshot.proximity.ids
    for table in (
        query.compute_point_pair_penetration(),
        query.find_collision_candidates(),
        query.compute_signed_distance_pairwise_closest_points(),
    ):
        assert pad not in {i for pair in table for i in (pair.id_A, pair.id_B)}
    assert pad not in {r.id_G for r in query.compute_signed_distance_to_point(np.zeros(3))}
    with pytest.raises(DeformableError, match=r"'pad'.*compute_deformable_contact"):
        query.compute_signed_distance_pair_closest_points(pad, world.ball1)


def test_it_is_checked_against_anchored_geometry(world, pad):
    """Being on the world frame filters no pair of it; declarations do."""
    graph, i = world.scene_graph, world.inspector
    second = graph.register_deformable_geometry(world.arm, WORLD, soft_instance("second"), 0.2)
    assert not i.collision_filtered(pad, world.floor)
    assert not i.collision_filtered(pad, second)
    assert (min(pad, world.floor), max(pad, world.floor)) in i.get_collision_candidates()
    graph.exclude_collisions_between(GeometrySet(pad), GeometrySet(world.floor))
    assert i.collision_filtered(pad, world.floor)
    assert not i.collision_filtered(second, world.floor)


def test_scope_that_omits_deformables(world, pad):
    """A declaration with the scope OMIT_DEFORMABLE excludes rigid pairs only."""
    i = world.inspector
    for scope, is_excluded in (
        (CollisionFilterScope.OMIT_DEFORMABLE, False),
        (CollisionFilterScope.ALL, True),
    ):
        everything = GeometrySet([pad, world.floor, world.ball1, world.crate])
        world.scene_graph.collision_filter_manager().apply(
            CollisionFilterDeclaration(scope).exclude_within(everything)
        )
        assert i.collision_filtered(world.ball1, world.crate)
        assert i.collision_filtered(pad, world.floor) == is_excluded


def test_roles_come_and_go(world):
    """A role is assigned, replaced and removed as with rigid geometry."""
    graph, i = world.scene_graph, world.inspector
    soft = graph.register_deformable_geometry(world.arm, WORLD, soft_instance(roles=()), 0.2)
    state = i._state
    assert state.deformable_ids(Role.PROXIMITY) == ()
    graph.assign_role(world.arm, soft, ProximityProperties())
    assert state.deformable_ids(Role.PROXIMITY) == (soft,)
    with pytest.raises(RoleError):
        graph.assign_role(world.arm, soft, ProximityProperties())
    graph.assign_role(world.arm, soft, ProximityProperties(), RoleAssign.REPLACE)
    assert graph.remove_role(world.arm, soft, Role.PROXIMITY) == 1
    assert i.get_roles(soft) == set()
