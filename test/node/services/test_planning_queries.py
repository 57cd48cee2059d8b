"""Configurations and edges of robots in the world: a ball of 0.1 m on a rail, a post in its way.

The post is a ball of 0.2 m at 1 m, so the two touch where the rail is at 0.7, and overlap by what
is beyond that.
"""

from __future__ import annotations

import numpy as np
import pytest
from sliding_robots import answer, rail_world, slide

from msg_adapters.errors import MessageError, TooLargeError
from scene_graph_msgs.msg import GeometryNames, QueryOptions, RobotConfigurations, WhatIf
from scene_graph_msgs.srv import CheckConfigurations, CheckEdges
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.planning import EdgeStatus

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES
BEYOND = CheckConfigurations.Response.BEYOND_LIMITS


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """One robot, whose rail is at -1."""
    return rail_world(tmp_path_factory.mktemp("rails"))


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """Two robots on rails that are 5 m apart."""
    return rail_world(tmp_path_factory.mktemp("two_rails"), two=True)


def at(*rails, name="rail"):
    """Return configurations."""
    return RobotConfigurations(names=[name], positions=list(map(float, rails)))


def post_at(*xs):
    """Return options that ask about the post elsewhere."""
    poses = [number for x in xs for number in (x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)]
    return QueryOptions(what_if=WhatIf(frames=["post"], poses=poses))


def names_of(table, row):
    """Return the names of the pair in a row of collisions."""
    names = dict(zip(table.geometries.id, table.geometries.name, strict=True))
    return {names[table.id_a[row]], names[table.id_b[row]]}


def test_rows_are_free_collide_or_are_beyond_limits(world):
    """With the pair and the depth of each that collides; a row beyond limits may collide, too."""
    found = answer(
        world,
        "CheckConfigurations",
        configurations=at(0.0, 0.75, 0.6, 1.0, 9.5),
        with_collisions=True,
    )
    assert list(found.outcomes) == [FREE, COLLIDES, FREE, COLLIDES, BEYOND]
    assert list(found.collisions.row) == [1, 3]
    np.testing.assert_allclose(found.collisions.depth, [0.05, 0.3], atol=1e-12)
    assert names_of(found.collisions, 0) == {"post", "ball_collision_0"}
    assert list(found.collisions.at) == [0.0, 0.0]


def test_pairs_are_told_where_they_are_asked_for(world):
    """And names where they are wanted."""
    quiet = answer(world, "CheckConfigurations", configurations=at(1.0))
    assert list(quiet.outcomes) == [COLLIDES]
    assert not len(quiet.collisions.row)
    told = answer(
        world,
        "CheckConfigurations",
        options=QueryOptions(with_names=False),
        configurations=at(1.0),
        with_collisions=True,
    )
    assert len(told.collisions.row) == 1
    assert told.collisions.geometries == GeometryNames()


@pytest.mark.parametrize(("padding", "outcome"), [(0.0, FREE), (0.09, FREE), (0.11, COLLIDES)])
def test_paddings_are_kept(world, padding, outcome):
    """The ball is 0.1 m from the post."""
    found = answer(
        world,
        "CheckConfigurations",
        configurations=at(0.6),
        environment_padding=padding,
        with_collisions=True,
    )
    assert list(found.outcomes) == [outcome]
    if outcome == COLLIDES:
        np.testing.assert_allclose(found.collisions.depth, [0.01], atol=1e-12)


def test_what_is_not_named_is_where_the_robots_are(tmp_path):
    """No names: the present configuration, which follows the joint's messages."""
    world = rail_world(tmp_path)
    assert list(answer(world, "CheckConfigurations").outcomes) == [FREE]
    before = world.snapshot
    slide(world, "slide", 1.0)
    found = answer(world, "CheckConfigurations", with_collisions=True)
    assert list(found.outcomes) == [COLLIDES]
    np.testing.assert_allclose(found.collisions.depth, [0.3], atol=1e-12)
    # What was a snapshot before still says where the robot was.
    assert before.positions["slide"].tolist() == [-1.0]


def test_poses_to_try_are_asked_one_after_another(world):
    """All rows for the first, then for the second; for a beginning of an edge that collides -1."""
    found = answer(
        world,
        "CheckConfigurations",
        options=post_at(1.0, 5.0),
        configurations=at(1.0, 5.0),
        with_collisions=True,
    )
    assert list(found.outcomes) == [COLLIDES, FREE, FREE, COLLIDES]
    assert list(found.collisions.row) == [0, 3]
    edges = answer(
        world, "CheckEdges", options=post_at(1.0, 5.0), ends=at(1.0, 2.0), with_measures=True
    )
    assert list(edges.outcomes) == [COLLIDES, FREE]
    assert list(edges.proven_up_to) == [-1.0, 1.0]


def test_edges_are_proven_or_say_what_stops_them(world):
    """From 0 to 2 the ball touches at 0.7, so up to 0.35; from 0 to 0.5 it keeps 0.2 m."""
    found = answer(
        world,
        "CheckEdges",
        ends=at(0.0, 0.5, 0.0, 2.0, 0.0, 9.5, 0.0, 0.7 - 1e-8),
        with_measures=True,
    )
    outcomes = CheckEdges.Response
    assert list(found.outcomes) == [
        outcomes.FREE,
        outcomes.COLLIDES,
        outcomes.BEYOND_LIMITS,
        outcomes.UNDECIDED,
    ]
    assert found.proven_up_to[0] == 1.0
    assert 0.0 < found.least_clearances[0] <= 0.2
    assert 0.34 < found.proven_up_to[1] <= 0.35
    assert found.least_clearances[1] == 0.0
    assert list(found.collisions.row) == [1, 2, 3]
    assert names_of(found.collisions, 0) == {"post", "ball_collision_0"}
    # Where it is on the edge, and how deep the two are in each other there, belong together.
    np.testing.assert_allclose(
        found.collisions.depth[0], 0.3 - abs(2.0 * found.collisions.at[0] - 1.0), atol=1e-12
    )
    assert -1e-6 < found.collisions.depth[2] < 0.0


def test_outcomes_of_edges_are_those_of_planning(world):
    """With and without measures."""
    response = CheckEdges.Response
    for status in EdgeStatus:
        assert getattr(response, status.name) == status.value
    ends = at(0.0, 0.5, 0.0, 2.0, 1.0, 2.0, 3.0, 2.0)
    quick = answer(world, "CheckEdges", ends=ends)
    assert not len(quick.proven_up_to)
    assert not len(quick.collisions.row)
    assert quick.outcomes == answer(world, "CheckEdges", ends=ends, with_measures=True).outcomes


def test_names_are_of_one_robot_or_say_which(two):
    """What both have is named with its robot; the other robot stays where it is."""
    found = answer(two, "CheckConfigurations", configurations=at(1.0, name="slide/rail"))
    assert list(found.outcomes) == [COLLIDES]
    found = answer(two, "CheckConfigurations", configurations=at(1.0, name="other/rail"))
    assert list(found.outcomes) == [FREE]
    with pytest.raises(NameConflictError, match="'rail' is ambiguous: slide/rail, other/rail"):
        answer(two, "CheckConfigurations", configurations=at(1.0))


def test_what_a_link_carries_moves_with_it(tmp_path):
    """A tip on a frame 0.3 m before the ball touches the post where the rail is at 0.45.

    Where the frame is moved, the tip is, too.
    """
    from scene_graph_ros.geometry import (
        GeometryFrame,
        GeometryInstance,
        ProximityProperties,
        Sphere,
    )

    world = rail_world(tmp_path)
    X_LF = np.eye(4)
    X_LF[0, 3] = 0.3

    def carry(edit):
        source, graph = edit.records["slide"].id, edit.scene_graph
        ball = graph.model_inspector().get_frame_id_by_name(source, "ball")
        frame = graph.register_frame(source, GeometryFrame("tool"), parent=ball)
        tip = GeometryInstance(np.eye(4), Sphere(0.05), "tip")
        tip.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frame, tip)
        edit.initial_poses[frame] = X_LF

    world.edit(carry)
    found = answer(
        world, "CheckConfigurations", configurations=at(0.44, 0.47), with_collisions=True
    )
    assert list(found.outcomes) == [FREE, COLLIDES]
    assert names_of(found.collisions, 0) == {"post", "tip"}
    np.testing.assert_allclose(found.collisions.depth, [0.02], atol=1e-12)
    with world.lock:
        frames = world.frames("slide")
        frames.X_PF[frames.names.index("tool"), 0, 3] = 0.2
        world.commit({"slide"}, None)
    assert list(answer(world, "CheckConfigurations", configurations=at(0.54, 0.57)).outcomes) == [
        FREE,
        COLLIDES,
    ]


BAD_ROWS = [
    (at(1.0, name="rial"), UnknownIdError, "configurations.names: no robot has a position 'rial'"),
    (
        RobotConfigurations(names=["rail", "slide/rail"], positions=[0.0, 0.5]),
        MessageError,
        "configurations: 'slide/rail' is at 0.5 in row 0 of positions, .* puts it at 0",
    ),
    (
        RobotConfigurations(positions=[1.0]),
        MessageError,
        "configurations has 1 positions, but no names",
    ),
    (at(0.0, np.nan), MessageError, "'slide/rail' in row 1 must be a number up to .*, not nan"),
    (at(1e300), MessageError, "'slide/rail' in row 0 must be a number up to .*, not 1e\\+300"),
]


@pytest.mark.parametrize(("rows", "error", "words"), BAD_ROWS)
def test_configurations_that_mean_nothing_are_refused(world, rows, error, words):
    """By field, name and value."""
    with pytest.raises(error, match=words):
        answer(world, "CheckConfigurations", configurations=rows)
    with pytest.raises(error, match=words.replace("configurations", "ends")):
        answer(world, "CheckEdges", ends=rows)


def test_lengths_must_fit(two):
    """Three numbers for two names, and three ends of edges."""
    rows = RobotConfigurations(names=["slide/rail", "other/rail"], positions=[0.0, 1.0, 2.0])
    with pytest.raises(
        MessageError, match="has 3 numbers, which is no multiple of the 2 of names"
    ):
        answer(two, "CheckConfigurations", configurations=rows)
    with pytest.raises(MessageError, match="ends has 3 rows; an edge has two"):
        answer(two, "CheckEdges", ends=at(0.0, 1.0, 2.0, name="slide/rail"))


@pytest.mark.parametrize("service", ["CheckConfigurations", "CheckEdges"])
@pytest.mark.parametrize("field", ["environment_padding", "self_padding"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300])
def test_paddings_must_be_numbers(world, service, field, value):
    """By name and value."""
    rows = {"CheckEdges": "ends", "CheckConfigurations": "configurations"}[service]
    with pytest.raises(MessageError, match=f"{field} must be a number up to .*, not"):
        answer(world, service, **{rows: at(0.0, 0.1), field: value})


def test_too_much_is_refused(world):
    """Rows times poses to try."""
    limits = {"max_robot_configurations_per_request": 5, "max_edges_per_request": 2}
    words = "configurations: 6 are more than max_robot_configurations_per_request, which is 5"
    with pytest.raises(TooLargeError, match=words):
        answer(
            world,
            "CheckConfigurations",
            limits,
            options=post_at(1.0, 2.0),
            configurations=at(1.0, 2.0, 3.0),
        )
    with pytest.raises(TooLargeError, match="edges: 3 are more than max_edges_per_request"):
        answer(world, "CheckEdges", limits, ends=at(*range(6)))


def test_links_are_where_their_positions_say(world):
    """A pose to try for one is refused."""
    options = QueryOptions(
        what_if=WhatIf(frames=["slide/ball"], poses=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    )
    with pytest.raises(MessageError, match=r"what_if\.frames: 'slide/ball' is a link of"):
        answer(world, "CheckConfigurations", options=options)


def test_a_scene_without_robots_says_so():
    """Nothing can be asked."""
    from scene_graph_ros.node.world.world import World

    with pytest.raises(UnknownIdError, match="the scene has no robot"):
        answer(World(), "CheckConfigurations")


def test_another_tier_of_accuracy_and_another_scene_are_followed(tmp_path):
    """What planning keeps of a scene is made anew where its model is another."""
    world = rail_world(tmp_path)
    assert list(answer(world, "CheckConfigurations", configurations=at(1.0)).outcomes) == [
        COLLIDES
    ]
    world.set_accuracy("quick")
    assert list(answer(world, "CheckConfigurations", configurations=at(1.0)).outcomes) == [
        COLLIDES
    ]
    world.edit(lambda edit: edit.remove_source(edit.records["around"]))
    assert list(answer(world, "CheckConfigurations", configurations=at(1.0)).outcomes) == [FREE]


def test_any_number_of_threads_gives_the_same_response(world):
    """Rows, or poses to try, are what they share."""
    rng = np.random.default_rng(3)
    rows = at(*rng.uniform(-2.0, 2.0, 200))
    for options in (QueryOptions(), post_at(0.0, 1.0, 2.0)):
        asked = {"options": options, "configurations": rows, "with_collisions": True}
        one = answer(world, "CheckConfigurations", **asked)
        assert answer(world, "CheckConfigurations", {"query_threads": 3}, **asked) == one
        assert set(one.outcomes) == {FREE, COLLIDES}


def test_clearances_in_batches(world):
    """Distances less their paddings, with how the rail changes them; what is far is left out."""
    found = answer(
        world,
        "CheckClearance",
        configurations=at(0.0, 0.5, 1.75, -5.0),
        environment_padding=0.05,
        influence_distance=0.5,
        with_jacobians=True,
    ).clearances
    # Centres are 1 - q apart, radii 0.3 together.
    assert list(found.row) == [1, 2]
    np.testing.assert_allclose(found.distance, [0.15, 0.4], atol=1e-12)
    assert list(found.kind) == [found.ENVIRONMENT] * 2
    assert found.position_names == ["slide/rail"]
    np.testing.assert_allclose(found.jacobian, [-1.0, 1.0], atol=1e-12)
    assert names_of(found, 0) == {"post", "ball_collision_0"}
    quiet = answer(world, "CheckClearance", configurations=at(0.65)).clearances
    np.testing.assert_allclose(quiet.distance, [0.05], atol=1e-12)
    assert not len(quiet.jacobian) and not quiet.position_names
    none = answer(world, "CheckClearance", configurations=at(-5.0)).clearances
    assert not len(none.row) and not len(none.distance)


def test_clearances_of_poses_to_try_and_of_two_robots(world, two):
    """Rows go on from one world to the next; the other robot is no surrounding."""
    found = answer(
        world, "CheckClearance", options=post_at(1.0, 5.0), configurations=at(0.65, 4.65)
    ).clearances
    assert list(found.row) == [0, 3]
    np.testing.assert_allclose(found.distance, [0.05, 0.05], atol=1e-12)
    found = answer(
        two, "CheckClearance", influence_distance=6.0, self_padding=0.5, with_jacobians=True
    ).clearances
    kinds = dict(zip(found.kind, found.distance, strict=True))
    # The rails are 5 m apart; both balls are where the rails are at their present places.
    assert set(kinds) == {found.SELF, found.ENVIRONMENT}
    assert len(found.jacobian) == 2 * len(found.row)


def test_clearances_that_make_no_sense_are_refused(world):
    """With the field and the value."""
    for value in (-0.1, float("nan"), float("inf")):
        with pytest.raises(MessageError, match="influence_distance must be a number from 0"):
            answer(world, "CheckClearance", influence_distance=value)
    with pytest.raises(UnknownIdError, match="no robot has a position 'x'"):
        answer(world, "CheckClearance", configurations=at(0.0, name="x"))
    limits = {"max_edges_per_request": 5}
    with pytest.raises(TooLargeError, match="configurations: 6 are more than max_edges"):
        answer(world, "CheckClearance", limits, configurations=at(*range(6)))
    limits = {"max_rows_per_response": 1}
    with pytest.raises(TooLargeError, match="rows of the answer: 2 are more than max_rows"):
        answer(world, "CheckClearance", limits, configurations=at(0.7, 0.7))
