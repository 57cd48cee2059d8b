"""Registering sources, frames and geometries, and who may."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Convex,
    FrameId,
    GeometryFrame,
    GeometryId,
    Mesh,
    ProximityProperties,
    Role,
    SceneGraph,
    SourceId,
)
from scene_graph_ros.geometry.errors import (
    MeshError,
    NameConflictError,
    OwnershipError,
    PropertyError,
    UnknownIdError,
)


def test_new_scene_graph_has_only_the_world():
    """One source of its own, which has the world frame, and no geometry."""
    inspector = SceneGraph().model_inspector()
    assert inspector.num_sources() == 1
    assert inspector.get_all_frame_ids() == [SceneGraph.world_frame_id()]
    assert inspector.num_geometries() == 0


def test_sources_have_unique_names():
    """A name given twice is refused, also after trimming."""
    scene_graph = SceneGraph()
    arm = scene_graph.register_source("arm")
    assert scene_graph.source_is_registered(arm)
    assert not scene_graph.source_is_registered(SourceId.get_new_id())
    for name in ("arm", " arm "):
        with pytest.raises(NameConflictError, match="'arm' is taken"):
            scene_graph.register_source(name)
    assert scene_graph.model_inspector().num_sources() == 2


def test_sources_without_a_name_get_one():
    """Each made-up name is new."""
    scene_graph = SceneGraph()
    names = {scene_graph.model_inspector().get_name(scene_graph.register_source()) for _ in "abc"}
    assert len(names) == 3


@pytest.mark.parametrize("name", [" ", None, 3])
def test_bad_source_name_is_refused(name):
    """Blank names and other things are no names."""
    with pytest.raises(NameConflictError, match="source"):
        SceneGraph().register_source(name)


def test_frame_names_are_unique_within_a_source(world):
    """Another source may use the same name, the same source may not."""
    with pytest.raises(NameConflictError, match="source 'arm' has a frame named 'link1'"):
        world.scene_graph.register_frame(world.arm, GeometryFrame(" link1"))
    assert world.inspector.get_name(world.box_frame) == "link1"


def test_frame_is_registered_once(world):
    """The same frame again is refused, also for another source."""
    frame = GeometryFrame("tool")
    assert world.scene_graph.register_frame(world.arm, frame) == frame.id()
    with pytest.raises(NameConflictError, match="registered already"):
        world.scene_graph.register_frame(world.other, frame)


def test_parent_frame_must_be_own_or_the_world(world):
    """A source cannot hang frames on another source's, nor on unknown ones."""
    with pytest.raises(OwnershipError, match="belongs to source 'arm', not to 'other'"):
        world.scene_graph.register_frame(world.other, GeometryFrame("f"), parent=world.link1)
    with pytest.raises(UnknownIdError, match="no frame"):
        world.scene_graph.register_frame(
            world.arm, GeometryFrame("f"), parent=FrameId.get_new_id()
        )
    world_frame = world.scene_graph.world_frame_id()
    frame = world.scene_graph.register_frame(world.arm, GeometryFrame("f"), parent=world_frame)
    assert world.inspector.get_parent_frame(frame) == world_frame


def test_geometry_keeps_the_instance_id(world):
    """The id of the instance is the id of what was registered, once."""
    ball = world.instance("extra")
    assert world.scene_graph.register_geometry(world.arm, world.link1, ball) == ball.id()
    with pytest.raises(NameConflictError, match=r"'extra'.*registered already"):
        world.scene_graph.register_geometry(world.arm, world.link2, ball)


def test_geometry_on_geometry_shares_its_frame(world):
    """X_FG is the product of the poses up to the frame, X_PG what was given."""
    register = world.scene_graph.register_geometry
    base = register(world.arm, world.link1, world.instance("a", X=world.translation(x=1.0)))
    quarter_turn = np.array([[0, -1, 0, 2], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
    turned = register(world.arm, base, world.instance("b", X=quarter_turn))
    leaf = register(world.arm, turned, world.instance("c", X=world.translation(x=5.0)))
    inspector = world.inspector
    assert inspector.get_frame_id(leaf) == world.link1
    assert inspector.get_parent_geometry(leaf) == turned
    # 1 along x, then 2 along x and a quarter turn, then 5 along the turned x, which is y.
    assert inspector.get_pose_in_frame(leaf)[:3, 3].tolist() == [3.0, 5.0, 0.0]
    assert inspector.get_pose_in_parent(leaf)[:3, 3].tolist() == [5.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="read-only"):
        inspector.get_pose_in_frame(leaf)[0, 3] = 0.0


def test_geometry_needs_an_own_parent(world):
    """Frames and geometries of another source, and unknown ones, are refused."""
    register = world.scene_graph.register_geometry
    for parent in (world.link1, world.ball1):
        with pytest.raises(OwnershipError, match="belongs to source 'arm', not to 'other'"):
            register(world.other, parent, world.instance("new"))
    for parent in (FrameId.get_new_id(), GeometryId.get_new_id(), "link1", None):
        with pytest.raises(UnknownIdError):
            register(world.arm, parent, world.instance("new"))
    assert world.inspector.num_geometries() == 4


@pytest.mark.parametrize("source_id", [SourceId.get_new_id(), SourceId(), "arm", None])
def test_unknown_source_can_do_nothing(world, source_id):
    """Each method refuses a source that is not registered."""
    graph = world.scene_graph
    for attempt in (
        lambda: graph.register_frame(source_id, GeometryFrame("f")),
        lambda: graph.register_geometry(source_id, world.link1, world.instance("g")),
        lambda: graph.register_anchored_geometry(source_id, world.instance("g")),
        lambda: graph.assign_role(source_id, world.ball1, ProximityProperties()),
        lambda: graph.remove_role(source_id, world.ball1, Role.PROXIMITY),
        lambda: graph.remove_geometry(source_id, world.ball1),
        lambda: graph.remove_frame(source_id, world.link1),
        lambda: graph.remove_source(source_id),
    ):
        with pytest.raises(UnknownIdError, match="no source is registered with id"):
            attempt()


def test_registered_geometry_gets_the_roles_of_its_instance(world):
    """Roles come with the properties; later changes of the instance change nothing."""
    ball = world.instance("new", proximity=True)
    ball.proximity_properties().add_property("g", "x", 1)
    geometry_id = world.scene_graph.register_geometry(world.arm, world.link1, ball)
    ball.proximity_properties().add_property("g", "y", 2)
    properties = world.inspector.get_proximity_properties(geometry_id)
    assert properties.get_properties_in_group("g") == {"x": 1}
    assert world.inspector.get_roles(geometry_id) == {Role.PROXIMITY}
    with pytest.raises(PropertyError, match="read-only"):
        properties.add_property("g", "z", 3)


def test_name_must_be_free_for_each_role(world):
    """On one frame a name is taken per role; without a role it is never taken."""
    register = world.scene_graph.register_geometry
    with pytest.raises(NameConflictError, match=r"'link1' has a geometry named 'ball'.*PROXIMITY"):
        register(world.arm, world.link1, world.instance(" ball", proximity=True))
    unassigned = [register(world.arm, world.link1, world.instance("ball")) for _ in range(2)]
    assert len(set(unassigned)) == 2
    assert world.inspector.num_geometries() == 6


def test_wrong_kinds_of_arguments_are_refused(world):
    """A frame is a GeometryFrame, a geometry a GeometryInstance, a context a Context."""
    with pytest.raises(TypeError, match="GeometryFrame"):
        world.scene_graph.register_frame(world.arm, "link")
    with pytest.raises(TypeError, match="GeometryInstance"):
        world.scene_graph.register_geometry(world.arm, world.link1, "ball")
    with pytest.raises(TypeError, match="create_default_context"):
        world.scene_graph.register_source("x", context=world.scene_graph)


@pytest.mark.parametrize("shape_type", [Convex, Mesh])
def test_unreadable_mesh_cannot_have_the_proximity_role(world, shape_type, tmp_path):
    """Registration reads the mesh; without the role nobody looks into the file."""
    path = tmp_path / "empty.obj"
    path.write_text("# nothing\n")
    before = world.inspector.num_geometries()
    with pytest.raises(MeshError, match=r"empty\.obj"):
        world.scene_graph.register_geometry(
            world.arm, world.link1, world.instance("m", proximity=True, shape=shape_type(path))
        )
    assert world.inspector.num_geometries() == before
    mesh = world.scene_graph.register_geometry(
        world.arm, world.link1, world.instance("m", shape=shape_type(path))
    )
    with pytest.raises(MeshError, match=r"empty\.obj"):
        world.scene_graph.assign_role(world.arm, mesh, ProximityProperties())
    assert world.inspector.get_roles(mesh) == set()


def test_anchored_geometry_of_every_source_hangs_on_the_world(world):
    """The world frame is open to all sources, by either method."""
    graph, world_frame = world.scene_graph, world.scene_graph.world_frame_id()
    a = graph.register_anchored_geometry(world.other, world.instance("a"))
    b = graph.register_geometry(world.other, world_frame, world.instance("b"))
    assert world.inspector.get_frame_id(a) == world.inspector.get_frame_id(b) == world_frame
    assert world.inspector.is_anchored(a)
    assert world.inspector.num_anchored_geometries() == 3
    assert world.inspector.num_dynamic_geometries() == 3
