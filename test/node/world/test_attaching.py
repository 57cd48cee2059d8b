"""A post that a ball on a rail carries, and a wall that the post would hit and not the ball.

The ball has a radius of 0.1 and is at -1 on the rail at first, the post one of 0.2 at 1; so it is
2 m before the ball. The wall is a ball of 0.3 at 4: the post touches it where the rail is at 1.5.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Pose
import numpy as np
import pytest
from sliding_robots import answer, rail_world, slide

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_batch
from scene_graph_msgs import srv
from scene_graph_msgs.msg import QueryOptions, RobotConfigurations, SourceHandle, WhatIf
from scene_graph_ros.geometry import GeometrySet
from scene_graph_ros.geometry.errors import (
    InvalidPoseError,
    NameConflictError,
    OwnershipError,
    UnknownIdError,
)
from scene_graph_ros.node.world.edits import EDITS
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.planning import EdgeStatus

WALL = """  - name: wall
    source: around
    pose: {xyz: [4, 0, 0]}
    shape: {type: sphere, radius: 0.3}
"""


@pytest.fixture
def world(tmp_path):
    """The robot, the post and the wall."""
    return rail_world(tmp_path, more=WALL)


def edit(world, name: str, **fields: Any) -> Any:
    """Return what an edit's service answers."""
    handle = world.handles["around"]
    fields.setdefault("source", SourceHandle(name="around", token=handle.token))
    service = getattr(srv, name)
    response = service.Response()
    request = service.Request(**fields)
    world.edit(lambda change: EDITS[name](request, response, change, None))
    return response


def attach(world, **fields: Any) -> Any:
    """Attach the post."""
    return edit(world, "AttachFrame", **{"frame": "post", "link": "ball", **fields})


def at(*rails):
    """Return configurations."""
    return RobotConfigurations(names=["rail"], positions=list(map(float, rails)))


def place(world, name="post"):
    """Return where on the x-axis a frame is."""
    snapshot = world.snapshot
    frame = snapshot.names.frame_id(name, "around")
    return snapshot.query.snapshot.pose_in_world(frame)[0, 3]


def send(world, x, parent):
    """Take a pose of the post as a message would bring it; return the faults."""
    intake = Intake("around", lambda words: None)
    batch = pose_batch(["post"], [parent], [0], [(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)])
    with world.lock:
        intake.accept(batch, world.frames("around"), TimeLimits(0, 0, 0))
        world.commit(["around"], None)
    return dict(intake.statistics.faults)


def test_what_is_attached_moves_with_its_link(world):
    """From where it is, as far as the link goes, and in queries, too."""
    found = attach(world)
    assert found.pose.position.x == pytest.approx(2.0, abs=1e-12)
    assert place(world) == pytest.approx(1.0, abs=1e-12)
    slide(world, "slide", 1.0)
    assert place(world) == pytest.approx(3.0, abs=1e-12)
    assert not world.snapshot.query.has_collisions()
    slide(world, "slide", 1.6)
    assert world.snapshot.query.has_collisions()


def test_planning_knows_what_a_link_carries(world):
    """What is carried hits the wall, and not the link; without it nothing does."""
    free = srv.CheckConfigurations.Response.FREE
    before = answer(world, "CheckConfigurations", configurations=at(0.0, 1.0, 1.45, 1.55))
    assert (np.array(before.outcomes) == free).tolist() == [True, False, True, True]
    attach(world)
    found = answer(world, "CheckConfigurations", configurations=at(0.0, 1.0, 1.45, 1.55))
    assert (np.array(found.outcomes) == free).tolist() == [True, True, True, False]
    found = answer(world, "CheckEdges", ends=at(-1.0, 1.49, -1.0, 3.0), with_measures=True)
    assert list(found.outcomes) == [EdgeStatus.FREE.value, EdgeStatus.COLLIDES.value]
    assert found.proven_up_to[1] == pytest.approx(2.5 / 4.0, abs=1e-5)
    names = dict(
        zip(found.collisions.geometries.id, found.collisions.geometries.name, strict=True)
    )
    assert {names[found.collisions.id_a[0]], names[found.collisions.id_b[0]]} == {"post", "wall"}
    # How it is held may be asked about: a metre nearer, it touches where the rail is at 2.5.
    poses = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    options = QueryOptions(what_if=WhatIf(frames=["post"], poses=poses))
    found = answer(world, "CheckConfigurations", options=options, configurations=at(2.45, 2.55))
    assert (np.array(found.outcomes) == free).tolist() == [True, False]


def test_it_may_be_put_into_the_link(world):
    """In the link's place it overlaps it, which is allowed as long as it is attached."""
    pose = Pose(position=Point(x=0.05))
    found = attach(world, link="slide/ball", touch_links=["ball"], with_pose=True, pose=pose)
    assert found.pose.position.x == 0.05
    assert place(world) == pytest.approx(-0.95, abs=1e-12)
    assert not world.snapshot.query.has_collisions()
    assert edit(world, "DetachFrame", frame="post").pose.position.x == pytest.approx(-0.95)
    assert world.snapshot.query.has_collisions()


def test_detached_it_stays_where_it_is(world):
    """And its link goes on alone; then poses of its source move it again."""
    attach(world)
    slide(world, "slide", 1.0)
    edit(world, "DetachFrame", frame="post")
    assert place(world) == pytest.approx(3.0, abs=1e-12)
    slide(world, "slide", -1.0)
    assert place(world) == pytest.approx(3.0, abs=1e-12)
    assert send(world, 0.5, "world") == {}
    assert place(world) == 0.5
    slide(world, "slide", 0.5)
    assert world.snapshot.query.has_collisions()
    # Once more, from where it is by now.
    assert attach(world).pose.position.x == pytest.approx(0.0, abs=1e-12)


def test_poses_of_what_is_attached_are_in_its_link(world):
    """Those in the world, or in no frame that is named, do not tear it out of the hand."""
    attach(world)
    for parent in ("world", ""):
        assert send(world, 7.0, parent) == {Fault.WRONG_PARENT: 1}
        assert place(world) == pytest.approx(1.0, abs=1e-12)
    assert send(world, 2.5, "ball") == {}
    assert place(world) == pytest.approx(1.5, abs=1e-12)


def test_filters_of_others_stay(world):
    """What was filtered before is filtered after."""
    names = world.snapshot.names
    frames = [names.frame_id("post", "around"), names.frame_id("ball", "slide")]
    world.edit(lambda e: e.scene_graph.exclude_collisions_within(GeometrySet(frames)))
    attach(world, with_pose=True)
    edit(world, "DetachFrame", frame="post")
    assert not world.snapshot.query.has_collisions()


def test_a_robot_that_goes_takes_what_it_carries(world):
    """As everything goes with what it hangs on."""
    attach(world)
    world.edit(lambda change: change.remove_source(change.records["slide"]))
    assert world.frames("around").ids == ()
    with pytest.raises(UnknownIdError, match="no frame 'post'"):
        edit(world, "DetachFrame", frame="post")


def test_requests_that_make_no_sense_change_nothing(world):
    """With the field and the name."""
    version = world.snapshot.scene_version
    for error, words, fields in (
        (
            UnknownIdError,
            "link: no robot has a link 'bal'; did you",
            {"link": "bal"},
        ),
        (UnknownIdError, "touch_links: no robot has .* 'x'", {"touch_links": ["x"]}),
        (UnknownIdError, "has no frame 'pots'", {"frame": "pots"}),
        (OwnershipError, "token", {"source": SourceHandle(name="around", token=1)}),
        (
            InvalidPoseError,
            "pose",
            {"with_pose": True, "pose": Pose(position=Point(x=float("nan")))},
        ),
    ):
        with pytest.raises(error, match=words):
            attach(world, **fields)
    own = world.handles["slide"]
    handle = SourceHandle(name="slide", token=own.token)
    with pytest.raises(MessageError, match="frame: 'ball' is a robot's own"):
        attach(world, source=handle, frame="ball")
    with pytest.raises(UnknownIdError, match="frame: 'post' is not attached"):
        edit(world, "DetachFrame", frame="post")
    assert world.snapshot.scene_version == version
    attach(world)
    with pytest.raises(NameConflictError, match="'post' is attached to 'slide/ball' already"):
        attach(world)


def test_paddings_of_single_pairs(world):
    """They hold whatever a request says for all others, until they are taken back."""
    free = srv.CheckConfigurations.Response.FREE

    def outcomes(*rails, **fields):
        found = answer(world, "CheckConfigurations", configurations=at(*rails), **fields)
        return (np.array(found.outcomes) == free).tolist()

    pair = {"frames_a": ["post"], "frames_b": ["slide/ball"]}
    edit(world, "SetPadding", **pair, paddings=[0.2])
    assert outcomes(0.49, 0.51) == [True, False]
    # The wall is not of the pair: the ball touches it where the rail is at 3.6.
    assert outcomes(0.49, 0.51, 3.39, 3.41, environment_padding=0.2) == [True, False, True, False]
    assert outcomes(0.49, 0.51, 3.49, 3.51, environment_padding=0.1) == [True, False, True, False]
    found = answer(world, "CheckClearance", configurations=at(0.4)).clearances
    np.testing.assert_allclose(found.distance, [0.1], atol=1e-12)
    edit(world, "SetPadding", **pair, paddings=[-0.1])
    assert outcomes(0.79, 0.81, environment_padding=0.3) == [True, False]
    edit(world, "SetPadding", **pair, paddings=[float("nan")])
    assert outcomes(0.69, 0.71) == [True, False]
    # What is carried keeps its own from what is anchored.
    attach(world)
    carried = {"frames_a": ["world"], "frames_b": ["post"]}
    edit(world, "SetPadding", **carried, paddings=[0.4])
    assert outcomes(1.09, 1.11) == [True, False]
    edit(world, "DetachFrame", frame="post")
    assert outcomes(3.59, 3.61) == [True, False]


def test_paddings_that_make_no_sense_change_nothing(world):
    """With the field and the names."""
    version = world.snapshot.scene_version
    for error, words, a, b, value in (
        (UnknownIdError, "'pots'", "pots", "ball", [0.1]),
        (MessageError, "'post' and 'post' are one frame", "post", "post", [0.1]),
        (MessageError, "neither of 'post' and 'world' is moved", "post", "world", [0.1]),
        (OwnershipError, "neither of 'ball' and 'world' is of source", "ball", "world", [0.1]),
        (MessageError, "have 1, 1 and 2 entries", "post", "ball", [0.1, 0.2]),
        (MessageError, "paddings must be a number up to", "post", "ball", [float("inf")]),
    ):
        with pytest.raises(error, match=words):
            edit(world, "SetPadding", frames_a=[a], frames_b=[b], paddings=value)
    assert world.snapshot.scene_version == version
