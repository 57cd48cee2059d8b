"""What the inspector tells about the model, by the newer and the older names."""

import itertools

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Convex,
    FrameId,
    GeometryId,
    GeometrySet,
    IllustrationProperties,
    Mesh,
    Role,
    SourceId,
)
from scene_graph_ros.geometry.errors import NameConflictError, RoleError, UnknownIdError


def test_counts(world):
    """Numbers of everything in the small world."""
    i = world.inspector
    assert i.num_sources() == 3
    assert i.num_frames() == 4
    assert i.num_geometries() == 4
    assert i.num_anchored_geometries() == 1
    assert i.num_dynamic_geometries() == 3
    assert i.num_deformable_geometries() == 0
    assert i.num_geometries_with_role(Role.PROXIMITY) == 4
    assert i.num_geometries_with_role(Role.ILLUSTRATION) == 0
    assert i.num_geometries_with_role(Role.UNASSIGNED) == 0
    assert i.num_frames_for_source(world.arm) == 2
    assert i.num_geometries_for_frame(world.link1) == 1
    assert i.num_geometries_for_frame_with_role(world.link1, Role.PROXIMITY) == 1
    assert i.num_geometries_for_frame_with_role(world.link1, Role.PERCEPTION) == 0
    assert i.num_geometries_for_frame(i.world_frame_id()) == i.num_anchored_geometries()


def test_lists(world):
    """Ids in the order of registration."""
    i = world.inspector
    assert i.get_all_source_ids()[1:] == [world.arm, world.other]
    assert i.get_all_frame_ids() == [
        i.world_frame_id(),
        world.link1,
        world.link2,
        world.box_frame,
    ]
    assert i.all_frame_ids() == i.get_all_frame_ids()
    everything = [world.ball1, world.ball2, world.floor, world.crate]
    assert i.get_all_geometry_ids() == everything
    assert i.get_all_geometry_ids(Role.PROXIMITY) == everything
    assert i.get_all_geometry_ids(Role.PERCEPTION) == []
    assert i.get_all_deformable_geometry_ids() == []
    assert i.frames_for_source(world.arm) == [world.link1, world.link2]
    assert i.get_frames_for_source(world.other) == [world.box_frame]
    assert i.get_geometries(world.link2) == [world.ball2]
    assert i.get_geometries(world.link2, Role.ILLUSTRATION) == []
    assert i.get_geometries_for_source(world.arm) == [world.ball1, world.ball2, world.floor]
    assert i.get_child_frames(world.link1) == [world.link2]


def test_geometry_ids_of_a_set(world):
    """Frames stand for their geometries; a role narrows the set down."""
    i = world.inspector
    some = GeometrySet(world.link1, world.floor)
    assert i.get_geometry_ids(some) == sorted([world.ball1, world.floor])
    assert i.get_geometry_ids(some, Role.PROXIMITY) == sorted([world.ball1, world.floor])
    assert i.get_geometry_ids(some, Role.PERCEPTION) == []


def test_names_and_owners(world):
    """Names and sources of all three kinds of things, also by the older methods' names."""
    i = world.inspector
    assert i.get_name(world.arm) == i.get_source_name(world.arm) == "arm"
    assert i.get_name(world.link2) == i.get_name_by_frame_id(world.link2) == "link2"
    assert i.get_name(world.floor) == i.get_name_by_geometry_id(world.floor) == "floor"
    assert i.get_name(i.world_frame_id()) == "world"
    assert i.get_source_id_by_name("other") == world.other
    assert i.get_frame_id_by_name(world.arm, " link2 ") == world.link2
    assert i.belongs_to_source(world.link1, world.arm)
    assert not i.belongs_to_source(world.crate, world.arm)
    assert i.get_owning_source_id(world.crate) == world.other
    assert i.get_owning_source_name(world.link2) == "arm"
    assert i.get_frame_group(world.link2) == 4
    assert i.get_frame_group(world.link1) == 0
    assert i.get_parent_frame(world.link2) == world.link1
    assert i.get_parent_frame(world.link1) == i.world_frame_id()
    assert i.get_parent_frame(i.world_frame_id()) == i.world_frame_id()


def test_geometry_id_by_name(world):
    """Looked up by frame, role and trimmed name."""
    i, graph = world.inspector, world.scene_graph
    assert i.get_geometry_id_by_name(world.link1, Role.PROXIMITY, " ball ") == world.ball1
    for role, name in ((Role.PROXIMITY, "nothing"), (Role.ILLUSTRATION, "ball")):
        with pytest.raises(UnknownIdError, match=f"on frame 'link1' with role {role.name}"):
            i.get_geometry_id_by_name(world.link1, role, name)
    first = graph.register_geometry(world.arm, world.link1, world.instance("twin"))
    assert i.get_geometry_id_by_name(world.link1, Role.UNASSIGNED, "twin") == first
    graph.register_geometry(world.arm, world.link1, world.instance("twin"))
    with pytest.raises(NameConflictError, match="there are 2 geometries"):
        i.get_geometry_id_by_name(world.link1, Role.UNASSIGNED, "twin")


UNKNOWN_FRAME, UNKNOWN_GEOMETRY = FrameId.get_new_id(), GeometryId.get_new_id()
UNKNOWN_SOURCE = SourceId.get_new_id()


@pytest.mark.parametrize(
    ("method", "arguments"),
    [
        ("get_name", [UNKNOWN_FRAME]),
        ("get_name", [UNKNOWN_GEOMETRY]),
        ("get_name", [UNKNOWN_SOURCE]),
        ("get_name", ["link1"]),
        ("frames_for_source", [UNKNOWN_SOURCE]),
        ("num_frames_for_source", [UNKNOWN_SOURCE]),
        ("get_geometries_for_source", [UNKNOWN_SOURCE]),
        ("get_source_id_by_name", ["nobody"]),
        ("get_frame_id_by_name", [UNKNOWN_SOURCE, "link1"]),
        ("get_owning_source_id", [UNKNOWN_FRAME]),
        ("get_owning_source_name", [UNKNOWN_GEOMETRY]),
        ("get_parent_frame", [UNKNOWN_FRAME]),
        ("get_child_frames", [UNKNOWN_FRAME]),
        ("get_frame_group", [UNKNOWN_FRAME]),
        ("num_geometries_for_frame", [UNKNOWN_FRAME]),
        ("get_geometries", [UNKNOWN_FRAME]),
        ("get_geometries", [UNKNOWN_GEOMETRY]),
        ("get_geometry_id_by_name", [UNKNOWN_FRAME, Role.PROXIMITY, "ball"]),
        ("get_geometry_id_by_name", [UNKNOWN_FRAME, Role.UNASSIGNED, "ball"]),
        ("get_geometry_ids", [GeometrySet(UNKNOWN_FRAME)]),
        ("get_geometry_ids", [GeometrySet(UNKNOWN_GEOMETRY)]),
        ("get_frame_id", [UNKNOWN_GEOMETRY]),
        ("get_frame_id", [FrameId()]),
        ("get_parent_geometry", [UNKNOWN_GEOMETRY]),
        ("is_anchored", [UNKNOWN_GEOMETRY]),
        ("is_deformable", [UNKNOWN_GEOMETRY]),
        ("get_shape", [UNKNOWN_GEOMETRY]),
        ("get_convex_hull", [UNKNOWN_GEOMETRY]),
        ("get_pose_in_frame", [UNKNOWN_GEOMETRY]),
        ("get_pose_in_parent", [UNKNOWN_GEOMETRY]),
        ("get_roles", [UNKNOWN_GEOMETRY]),
        ("get_properties", [UNKNOWN_GEOMETRY, Role.PROXIMITY]),
        ("get_proximity_properties", [UNKNOWN_GEOMETRY]),
        ("get_illustration_properties", [UNKNOWN_GEOMETRY]),
        ("get_perception_properties", [UNKNOWN_GEOMETRY]),
        ("collision_filtered", [UNKNOWN_GEOMETRY, UNKNOWN_GEOMETRY]),
        ("clone_geometry_instance", [UNKNOWN_GEOMETRY]),
    ],
)
def test_unknown_ids_are_refused(world, method, arguments):
    """Every method refuses an id that names nothing, and quotes it."""
    with pytest.raises(UnknownIdError):
        getattr(world.inspector, method)(*arguments)


def test_collision_candidates(world):
    """All pairs but those on one frame; balls, floor and crate are on four frames."""
    ids = sorted([world.ball1, world.ball2, world.floor, world.crate])
    assert world.inspector.get_collision_candidates() == list(itertools.combinations(ids, 2))
    world.scene_graph.register_anchored_geometry(world.other, world.instance("w", proximity=True))
    world.scene_graph.register_geometry(
        world.arm, world.link1, world.instance("second", proximity=True)
    )
    # 6 geometries make 15 pairs; the two on the world and the two on link1 are no candidates.
    assert len(world.inspector.get_collision_candidates()) == 13


def test_collision_filtered_needs_the_role(world):
    """A geometry without the proximity role is in no pair."""
    ghost = world.scene_graph.register_geometry(world.arm, world.link1, world.instance("ghost"))
    for pair in ((ghost, world.crate), (world.crate, ghost)):
        with pytest.raises(RoleError, match=r"'ghost'.*no proximity role"):
            world.inspector.collision_filtered(*pair)
    assert not world.inspector.collision_filtered(world.ball1, world.crate)
    assert world.inspector.collision_filtered(world.ball1, world.ball1)


def test_clone_is_ready_to_be_registered(world):
    """Shape, name, pose and roles are those of the geometry; the id is new."""
    ball = world.instance("original", X=world.translation(z=0.4), proximity=True)
    ball.proximity_properties().add_property("g", "x", 1)
    ball.set_illustration_properties(IllustrationProperties())
    original = world.scene_graph.register_geometry(world.arm, world.ball1, ball)
    clone = world.inspector.clone_geometry_instance(original)
    assert clone.id() != original
    assert clone.name() == "original"
    assert clone.shape() == ball.shape()
    assert np.array_equal(clone.pose(), world.translation(z=0.4))
    clone.proximity_properties().add_property("g", "y", 2)
    assert not world.inspector.get_proximity_properties(original).has_property("g", "y")
    registered = world.scene_graph.register_geometry(world.arm, world.link2, clone)
    assert world.inspector.get_roles(registered) == {Role.PROXIMITY, Role.ILLUSTRATION}


def test_poses_by_their_older_names(world):
    """X_FG and X_PG are the older names of the fixed poses."""
    child = world.scene_graph.register_geometry(
        world.arm, world.ball1, world.instance("child", X=world.translation(x=1.0))
    )
    assert np.array_equal(world.inspector.X_FG(child), world.inspector.get_pose_in_frame(child))
    assert np.array_equal(world.inspector.X_PG(child), world.translation(x=1.0))


def test_convex_hull(world):
    """The hull of a cube's corners and centre has eight vertices, scaled; others have none."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    points = [*corners, (0, 0, 0)]
    triangle = Mesh(vertices=[*points, (9, 9, 9)], faces=[(0, 1, 2)])
    for shape, count in ((Convex(vertices=points, scale=2.0), 8), (triangle, 3)):
        geometry = world.scene_graph.register_geometry(
            world.arm, world.link1, world.instance(f"{count}", shape=shape)
        )
        hull = world.inspector.get_convex_hull(geometry)
        assert len(hull.vertices) == count
        assert np.abs(hull.vertices).max() == shape.scale[0]
    assert world.inspector.get_convex_hull(world.ball1) is None


def test_versions_change_with_their_role(world):
    """A change of one role's geometry changes that role's version only."""
    i, graph = world.inspector, world.scene_graph
    before = i.geometry_version()
    assert i.geometry_version().is_same_as(before, Role.PROXIMITY)
    graph.assign_role(world.arm, world.ball1, IllustrationProperties())
    after = i.geometry_version()
    assert after.is_same_as(before, Role.PROXIMITY)
    assert after.is_same_as(before, Role.PERCEPTION)
    assert not after.is_same_as(before, Role.ILLUSTRATION)
    graph.change_shape(world.arm, world.ball1, Box(1.0, 1.0, 1.0))
    last = i.geometry_version()
    assert not last.is_same_as(after, Role.PROXIMITY)
    assert not last.is_same_as(after, Role.ILLUSTRATION)
    assert last.is_same_as(after, Role.PERCEPTION)
    with pytest.raises(RoleError, match="UNASSIGNED"):
        last.is_same_as(after, Role.UNASSIGNED)
    graph.register_geometry(world.arm, world.link1, world.instance("no role"))
    assert i.geometry_version() == last


@pytest.mark.parametrize("role", ["PROXIMITY", 1, None])
def test_what_is_no_role_is_refused(world, role):
    """A role's name or number finds nothing silently: it is refused with its value."""
    i, frame = world.inspector, world.link1
    questions = [
        lambda: i.num_geometries_with_role(role),
        lambda: i.get_properties(world.ball1, role),
        lambda: i.get_geometry_id_by_name(frame, role, "ball"),
        lambda: i.geometry_version().is_same_as(i.geometry_version(), role),
        lambda: world.instance().properties(role),
        lambda: world.scene_graph.remove_role(world.arm, world.ball1, role),
    ]
    if role is None:  # These take None for "whatever its role".
        del questions[0]
    else:
        questions += [
            lambda: i.get_all_geometry_ids(role),
            lambda: i.get_geometries(frame, role),
            lambda: i.get_geometry_ids(GeometrySet(frame), role),
        ]
    for question in questions:
        with pytest.raises(RoleError, match=f"not {role!r}"):
            question()


def test_the_worlds_source_has_the_worlds_frame(world):
    """One frame, in a group that no other frame can have."""
    i = world.inspector
    source = i.get_owning_source_id(i.world_frame_id())
    assert i.frames_for_source(source) == [i.world_frame_id()]
    assert i.num_frames_for_source(source) == 1
    assert i.get_frame_group(i.world_frame_id()) == -1
    assert i.get_frame_group(world.link1) == 0
    assert i.world_frame_id() not in i.frames_for_source(world.arm)


def test_a_set_takes_what_another_holds(world):
    """Frames stay frames; the set that was added is not changed later."""
    first = GeometrySet(world.link1)
    ball = GeometryId.get_new_id()
    second = GeometrySet(ball, first)
    first.add(FrameId.get_new_id())
    assert second.frame_ids() == {world.link1}
    assert second.geometry_ids() == {ball}
    second.add(second)
    assert second.geometry_ids() == {ball}
