"""Links without geometry carry, too, and single geometries have paddings of their own.

A ball of 0.1 m is at -1 on a rail along x, with a tool 0.3 before it and another 0.2 above that,
both without geometry. A post of 0.2 m, with a hat above it, is at 1; the wall is at 4.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
import pytest
from robot_scenes import SLIDE
from sliding_robots import answer, slide

from msg_adapters.errors import MessageError
from scene_graph_msgs import srv
from scene_graph_msgs.msg import RobotConfigurations, SourceHandle
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import OwnershipError, UnknownIdError
from scene_graph_ros.node.world.edits import EDITS
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

TOOLS = """
  <link name="turning"/><link name="tip"/><link name="tool"/>
  <joint name="to_tool" type="fixed"><parent link="ball"/><child link="tool"/>
    <origin xyz="0.3 0 0" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="to_tip" type="fixed"><parent link="tool"/><child link="tip"/>
    <origin xyz="0 0 0.2"/></joint>
  <joint name="to_turning" type="continuous"><parent link="tip"/><child link="turning"/>
    <axis xyz="0 0 1"/></joint>
</robot>"""
SCENE = """
version: 1
sources: [{name: around}]
robots: [{name: slide, urdf: robot.urdf, positions: {rail: -1}}]
frames: [{name: post, source: around, pose: {xyz: [1, 0, 0]}}]
geometries:
  - {name: post, source: around, frame: post, shape: {type: sphere, radius: 0.2}}
  - name: hat
    source: around
    frame: post
    pose: {xyz: [0, 0, 0.3]}
    shape: {type: sphere, radius: 0.2}
  - {name: wall, source: around, pose: {xyz: [4, 0, 0]}, shape: {type: sphere, radius: 0.3}}
"""


@pytest.fixture
def world(tmp_path) -> World:
    """Return the world."""
    (tmp_path / "robot.urdf").write_text(SLIDE.replace("</robot>", TOOLS))
    (tmp_path / "scene.yaml").write_text(SCENE)
    world, loader = World(SceneGraph()), SceneLoader("", message_type, ())
    world.edit(lambda edit: loader.load(edit, str(tmp_path / "scene.yaml")))
    return world


def edit(world: World, name: str, **fields: Any) -> Any:
    """Return what an edit's service answers."""
    token = world.handles["around"].token
    request = getattr(srv, name).Request(
        **{"source": SourceHandle(name="around", token=token), **fields}
    )
    response = getattr(srv, name).Response()
    world.edit(lambda change: EDITS[name](request, response, change, None))
    return response


def place(world: World) -> np.ndarray:
    """Return where the post is in the world."""
    snapshot = world.snapshot
    return snapshot.query.snapshot.pose_in_world(snapshot.names.frame_id("post", "around"))


def free(world: World, *rails: float, **fields: Any) -> list[bool]:
    """Tell which positions of the rail are free."""
    q = RobotConfigurations(names=["rail"], positions=list(rails))
    found = answer(world, "CheckConfigurations", configurations=q, **fields)
    return (np.array(found.outcomes) == srv.CheckConfigurations.Response.FREE).tolist()


def test_a_link_without_geometry_carries_from_where_a_thing_is(world):
    """The tip is at (-0.7, 0, 0.2), turned by a quarter: the post is 1.7 m to its right."""
    found = edit(world, "AttachFrame", frame="post", link="tip").pose.position
    assert (found.x, found.y, found.z) == pytest.approx((0.0, -1.7, -0.2), abs=1e-12)
    assert place(world)[:3, 3] == pytest.approx([1, 0, 0], abs=1e-12)
    slide(world, "slide", 0.5)
    assert place(world)[:3, 3] == pytest.approx([2.5, 0, 0], abs=1e-12)
    # The post touches the wall where it is at 3.5, so the rail at 1.5.
    assert free(world, 1.49, 1.51) == [True, False]
    assert edit(world, "DetachFrame", frame="post").pose.position.x == pytest.approx(2.5)
    slide(world, "slide", -1.0)
    assert place(world)[:3, 3] == pytest.approx([2.5, 0, 0], abs=1e-12)


def test_a_pose_in_a_link_without_geometry(world):
    """A metre to the tool's left is a metre behind it, as it is turned."""
    pose = Pose(position=Point(y=1.0), orientation=Quaternion(w=1.0))
    found = edit(world, "AttachFrame", frame="post", link="tool", with_pose=True, pose=pose,
                 touch_links=["ball", "tip"])  # fmt: skip
    assert found.pose == pose
    assert place(world)[:3, 3] == pytest.approx([-1.7, 0, 0], abs=1e-12)
    np.testing.assert_allclose(place(world)[:3, 0], [0, 1, 0], atol=1e-12)


def test_a_link_that_turns_without_geometry_carries(world):
    """It is at (0.3, 0, 0.2) of the ball, which is at 0.5, turned by the angle and a quarter."""
    slide(world, "slide", 0.5)
    slide(world, "slide", np.pi / 2, "to_turning")
    found = edit(world, "AttachFrame", frame="post", link="turning").pose.position
    assert (found.x, found.y, found.z) == pytest.approx((-0.2, 0, -0.2), abs=1e-12)
    assert place(world)[:3, 3] == pytest.approx([1, 0, 0], abs=1e-12)
    assert world.snapshot.frame_stamp("slide/turning") == world.snapshot.frame_stamp("slide/ball")
    slide(world, "slide", 0.0, "to_turning")
    assert place(world)[:3, 3] == pytest.approx([0.8, -0.2, 0], abs=1e-12)
    touches = 4 - (0.5**2 - 0.2**2) ** 0.5 - 0.3
    assert free(world, touches - 1e-3, touches + 1e-3) == [True, False]
    slide(world, "slide", -1.0)
    edit(world, "DetachFrame", frame="post")
    slide(world, "slide", 0.5)
    assert place(world)[:3, 3] == pytest.approx([-0.7, -0.2, 0], abs=1e-12)
    edit(world, "AttachFrame", frame="post", link="turning")  # its frame is there by now
    slide(world, "slide", 0.6)
    assert place(world)[:3, 3] == pytest.approx([-0.6, -0.2, 0], abs=1e-12)


def test_joints_that_move_while_a_link_gets_its_frame(world):
    """What arrives between the edit's beginning and its end counts."""
    request = srv.AttachFrame.Request(frame="post", link="turning")
    request.source = SourceHandle(name="around", token=world.handles["around"].token)

    def change(draft: Any) -> None:
        EDITS["AttachFrame"](request, srv.AttachFrame.Response(), draft, None)
        slide(world, "slide", 0.0)

    world.edit(change)
    assert place(world)[:3, 3] == pytest.approx([2, 0, 0], abs=1e-12)


def test_paddings_of_geometries(world):
    """One geometry of a frame, against a link or all; what is named more exactly wins."""
    nan, hat = float("nan"), "around/post/hat"

    def pad(a: str, b: str, value: float) -> None:
        edit(world, "SetPadding", frames_a=[a], frames_b=[b], paddings=[value])

    # From the rail the hat is sqrt(x² + 0.3²) - 0.3 away, x before the post.
    assert free(world, 0.69, 0.71) == [True, False]
    pad(hat, "ball", 0.2)
    touches = 1.0 - (0.5**2 - 0.3**2) ** 0.5
    assert free(world, touches - 1e-3, touches + 1e-3) == [True, False]
    pad("around/post/post", "", 0.5)
    assert free(world, 0.19, 0.21) == [True, False]
    pad("around/post/post", "slide/ball", 0.3)  # the frame is named: a pair
    assert free(world, 0.39, 0.41) == [True, False]
    pad("", "around/post/post", nan)
    pad("slide/ball", "around/post/post", nan)
    pad("ball", hat, nan)
    pad("around/post", "ball", -0.1)
    assert free(world, 0.79, 0.81, environment_padding=0.1) == [True, False]
    # Nobody named the wall: 3.6 without, 3.5 with the request's.
    assert free(world, 3.49, 3.51, environment_padding=0.1) == [True, False]


def test_what_is_no_pair_of_geometries_is_refused(world):
    """By name, by owner, and where no robot moves either."""
    for error, words, a, b in (
        (UnknownIdError, "no frame or geometry 'hut'", "hut", "ball"),
        (MessageError, "'around/post/hat' and 'hat' are one geometry", "around/post/hat", "hat"),
        (MessageError, "neither of 'hat' and 'wall' is moved by a robot", "hat", "wall"),
        (OwnershipError, "neither of '' and 'ball' is of source 'around'", "", "ball"),
        (MessageError, "'' and '' are one frame", "", ""),
    ):
        with pytest.raises(error, match=words):
            edit(world, "SetPadding", frames_a=[a], frames_b=[b], paddings=[0.1])
