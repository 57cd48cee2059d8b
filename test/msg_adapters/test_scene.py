"""Registration requests to the core's objects, and descriptions of a scene."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from msg_adapters import scene as adapters
from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    FrameDescription,
    GeometryDescription,
    GeometryReference,
    GeometrySet,
    RoleProperties,
    SourceInfo,
)
from scene_graph_ros.geometry.errors import (
    InvalidPoseError,
    InvalidShapeError,
    NameConflictError,
    UnknownIdError,
)
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.properties import (
    IllustrationProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.views.items import draw_items

X = pose_from_xyz_rpy((1.5, -2.5, 3.5), (0.1, 0.2, 0.3))


def test_a_frame_survives_the_wire(over_the_wire: Callable[[Any], Any]) -> None:
    """Name, group, parent and first pose arrive."""
    msg = over_the_wire(adapters.frame_to_msg(GeometryFrame("elbow", 4), X, "shoulder"))
    frame, X_PF = adapters.frame_from_msg(msg)
    assert (frame.name(), frame.frame_group(), msg.parent) == ("elbow", 4, "shoulder")
    np.testing.assert_allclose(X_PF, X, rtol=0, atol=1e-15)


def test_a_frame_that_is_none_is_refused() -> None:
    """A negative group, an empty name, a pose without rotation."""
    good = pose_to_msg(X)
    with pytest.raises(MessageError, match="-1"):
        adapters.frame_from_msg(FrameDescription(name="f", frame_group=-1, pose=good))
    with pytest.raises(NameConflictError):
        adapters.frame_from_msg(FrameDescription(name=" ", pose=good))
    zero = FrameDescription(name="f")
    zero.pose.orientation.w = 0.0
    with pytest.raises(InvalidPoseError, match="frame f"):
        adapters.frame_from_msg(zero)


def test_a_geometry_survives_the_wire(over_the_wire: Callable[[Any], Any]) -> None:
    """Name, shape, pose and the properties of each role arrive."""
    instance = GeometryInstance(X, Box(0.1, 0.2, 0.3), "crate")
    proximity, illustration = ProximityProperties(), IllustrationProperties()
    proximity.add_property("material", "static_friction", 0.75)
    illustration.add_property("phong", "diffuse", Rgba(0.1, 0.2, 0.3, 0.4))
    instance.set_proximity_properties(proximity)
    instance.set_illustration_properties(illustration)
    back = adapters.instance_from_msg(over_the_wire(adapters.instance_to_msg(instance)))
    assert (back.name(), back.shape()) == ("crate", Box(0.1, 0.2, 0.3))
    np.testing.assert_allclose(back.pose(), X, rtol=0, atol=1e-15)
    assert back.proximity_properties() == proximity
    assert back.illustration_properties() == illustration
    assert back.perception_properties() is None


def test_a_geometry_that_is_none_is_refused() -> None:
    """Pose, shape, name and a role given twice are each complained about as what they are."""
    good = adapters.instance_to_msg(GeometryInstance(X, Sphere(0.5), "ball"))

    def changed(**fields: Any) -> GeometryDescription:
        values = {field: getattr(good, field) for field in ("name", "shape", "pose", "roles")}
        return GeometryDescription(**{**values, **fields})

    far = pose_to_msg(X)
    far.position.x = float("inf")
    negative = adapters.shape_to_msg(Sphere(0.5))
    negative.dimensions = [-0.5]
    twice = [RoleProperties(role=1), RoleProperties(role=1)]
    for msg, error in (
        (changed(pose=far), InvalidPoseError),
        (changed(shape=negative), InvalidShapeError),
        (changed(name=""), NameConflictError),
        (changed(roles=twice), MessageError),
    ):
        with pytest.raises(error):
            adapters.instance_from_msg(msg)


def test_a_set_holds_geometries_and_frames(scene: SimpleNamespace) -> None:
    """Ids and names of both kinds lead to the ids of the core."""
    msg = GeometrySet(
        geometries=[GeometryReference(id=int(scene.floor)), GeometryReference(name="tip")],
        frames=["arm/base"],
    )
    result = adapters.geometry_set_from_msg(msg, scene.names)
    assert result.geometry_ids() == {scene.floor, scene.tip}
    assert result.frame_ids() == {scene.base}
    with pytest.raises(UnknownIdError, match="nowhere"):
        adapters.geometry_set_from_msg(GeometrySet(frames=["nowhere"]), scene.names)


def _statement(operation: int, a: list[str], b: list[str]) -> CollisionFilterStatement:
    return CollisionFilterStatement(
        operation=operation,
        a=GeometrySet(geometries=[GeometryReference(name=name) for name in a]),
        b=GeometrySet(geometries=[GeometryReference(name=name) for name in b]),
    )


@pytest.mark.parametrize(
    ("statements", "filtered"),
    [
        ([(CollisionFilterStatement.EXCLUDE_WITHIN, ["tip", "floor"], [])], True),
        ([(CollisionFilterStatement.EXCLUDE_BETWEEN, ["tip"], ["floor"])], True),
        ([(CollisionFilterStatement.EXCLUDE_BETWEEN, ["tip", "floor"], ["arm/base/ball"])], False),
        (
            [
                (CollisionFilterStatement.EXCLUDE_WITHIN, ["tip", "floor"], []),
                (CollisionFilterStatement.ALLOW_BETWEEN, ["floor"], ["tip"]),
            ],
            False,
        ),
        (
            [
                (CollisionFilterStatement.ALLOW_WITHIN, ["tip", "floor"], []),
                (CollisionFilterStatement.EXCLUDE_BETWEEN, ["floor"], ["tip"]),
            ],
            True,
        ),
    ],
)
def test_statements_are_applied_in_their_order(
    scene: SimpleNamespace, statements: list[tuple], filtered: bool
) -> None:
    """Whether tip and floor may collide after each list of statements, by a real scene."""
    messages = [_statement(*statement) for statement in statements]
    declaration = adapters.filter_from_msg(messages, scene.names)
    assert not scene.inspector.collision_filtered(scene.tip, scene.floor)
    scene.graph.collision_filter_manager().apply(declaration)
    assert scene.inspector.collision_filtered(scene.tip, scene.floor) is filtered


def test_an_unknown_filter_operation_is_refused(scene: SimpleNamespace) -> None:
    """There are four."""
    with pytest.raises(MessageError, match="operation 4"):
        adapters.filter_from_msg([_statement(4, ["tip"], [])], scene.names)


def test_a_source_is_described_with_its_topic(scene: SimpleNamespace) -> None:
    """Each argument lands in its own field."""
    assert adapters.source_to_msg(
        scene.arm, "arm", pose_topic="/arm/poses", pose_type="T", stamp_ns=3_000_000_004
    ) == SourceInfo(
        id=int(scene.arm),
        name="arm",
        pose_topic="/arm/poses",
        pose_type="T",
        stamp=stamp_to_msg(3_000_000_004),
    )


def test_frames_are_described_with_parent_and_world_pose(scene: SimpleNamespace) -> None:
    """The hand hangs on the base, the base on the world."""
    poses = {scene.base: X, scene.hand: np.eye(4)}
    base, hand = adapters.frames_to_msg(
        scene.inspector, scene.names, [scene.base, scene.hand], poses.__getitem__
    )
    assert (base.id, base.name, base.source) == (int(scene.base), "base", "arm")
    assert (base.parent, base.frame_group) == ("world", 3)
    assert (hand.parent_id, hand.parent, hand.frame_group) == (int(scene.base), "base", 0)
    assert base.pose == pose_to_msg(X) and hand.pose == pose_to_msg(np.eye(4))
    assert adapters.frames_to_msg(scene.inspector, scene.names, [], poses.__getitem__) == []


def test_geometries_are_described_as_far_as_asked(
    scene: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Shape and properties come on request; who, where and which roles always."""
    full, brief = (
        over_the_wire(
            adapters.geometries_to_msg(
                scene.inspector, scene.names, [scene.tip], with_shapes=asked, with_properties=asked
            )[0]
        )
        for asked in (True, False)
    )
    for info in (full, brief):
        assert info.geometry == scene.names.geometry_name(scene.tip)
        assert list(info.roles) == [RoleProperties.PROXIMITY, RoleProperties.ILLUSTRATION]
        assert info.description.name == "tip"
        assert info.description.pose.position.y == 2.0
        assert [r.role for r in info.description.roles] == list(info.roles)
    assert list(full.description.shape.dimensions) == [0.125]
    assert [p.name for p in full.description.roles[1].properties] == ["diffuse"]
    assert list(brief.description.shape.dimensions) == []
    assert list(brief.description.roles[1].properties) == []
    # What was described in full registers the same geometry again.
    assert adapters.instance_from_msg(full.description).shape() == Sphere(0.125)


def test_marker_items_take_ids_as_messages_have_them(scene: SimpleNamespace) -> None:
    """Integers and ids name the same geometries, in their order; unknown ones are refused."""
    items = adapters.marker_items(
        scene.inspector, scene.names, Role.PROXIMITY, [int(scene.tip), scene.floor]
    )
    ids = [scene.tip, scene.floor]
    assert items == draw_items(scene.inspector, Role.PROXIMITY, ids)
    assert [item.geometry_id for item in items] == [int(each) for each in ids]
    with pytest.raises(UnknownIdError):
        adapters.marker_items(scene.inspector, scene.names, Role.PROXIMITY, [10**9])
