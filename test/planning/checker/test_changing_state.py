"""Shapes, paddings and filters of a checker that change, held to the scene's own queries."""

import itertools
import math
from threading import Thread

import numpy as np
import pytest
from robot_scenes import BALL, diagram, move, SLIDE

from scene_graph_ros.geometry import Box, GeometryInstance, HalfSpace, ProximityProperties, Sphere
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.tolerances import OSCULATION
from scene_graph_ros.planning import (
    BodyShapeDescription,
    CollisionCheckerError,
    EdgeStatus,
    load_robot_diagram,
    make_body_shape_description,
    plan_path,
    RobotClearance,
    RobotCollisionType,
    SceneGraphCollisionChecker,
)

CELL = "config/scenes/panda_cell.yaml"
GRASPED = Box(0.04, 0.06, 0.2)
POLE = Box(0.05, 0.05, 0.8)


def lifted(z):
    """Return a pose so far along z."""
    X = np.eye(4)
    X[2, 3] = z
    return X


def configurations(tree, count, seed):
    """Return random configurations within limits."""
    rng = np.random.default_rng(seed)
    return rng.uniform(tree.lower, tree.upper, (count, tree.num_positions))


def two_slides(folder):
    """Return two balls on one rail, each of a robot."""
    (folder / "slide.urdf").write_text(SLIDE)
    (folder / "two.yaml").write_text(
        "version: 1\nrobots:\n  - {name: left, urdf: slide.urdf}\n"
        "  - {name: right, urdf: slide.urdf}\n"
    )
    return load_robot_diagram(folder / "two.yaml")


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return load_robot_diagram(CELL)


@pytest.fixture
def checker(cell):
    """Its checker, for one test."""
    return SceneGraphCollisionChecker(cell)


class Oracle:
    """Answers about a checker's pairs, by one query of the scene for each pair of geometries."""

    def __init__(self, robots, checker):
        self.robots = robots
        inspector = robots.context.inspector()
        self.body = {b.frame_id: b.index for b in checker.bodies}
        self.robot_bodies = [b.index for b in checker.bodies if checker.is_part_of_robot(b)]
        filters = checker.get_filtered_collision_matrix()
        nominal = checker.get_nominal_filtered_collision_matrix()
        paddings = checker.get_padding_matrix()
        self.pairs = []
        ids = sorted(inspector.get_all_geometry_ids(Role.PROXIMITY))
        for first, second in itertools.combinations(ids, 2):
            a, b = (self.body[inspector.get_frame_id(each)] for each in (first, second))
            stays = inspector.collision_filtered(first, second) and nominal[a, b] != 1
            if a != b and filters[a, b] == 0 and not stays:
                sizes = [inspector.get_shape(each) for each in (first, second)]
                self.pairs.append((first, second, a, b, paddings[a, b], sizes))

    def overlaps(self, q):
        """Return the pairs that are nearer than their padding, by more than rounding."""
        query, result = move(self.robots, q), []
        for first, second, a, b, padding, _ in self.pairs:
            distance = query.compute_signed_distance_pair_closest_points(first, second).distance
            assert abs(distance - padding) > 10 * OSCULATION
            if distance < padding:
                result.append((first, second, a, b, distance - padding))
        return result

    def types(self, q):
        """Return what each body collides with."""
        result = [0] * len(self.body)
        for _, _, a, b, _ in self.overlaps(q):
            for one, other in ((a, b), (b, a)):
                if one in self.robot_bodies:
                    result[one] |= 2 if other in self.robot_bodies else 1
        return [RobotCollisionType(each) for each in result]


def agree(checker, oracle, q):
    """Hold a checker's answers on configurations to an oracle's; return how many are free."""
    free = checker.check_configs_collision_free(q)
    assert checker.num_pairs == checker.max_num_distances() == len(oracle.pairs)
    for each, is_free in zip(q, free, strict=True):
        found = oracle.overlaps(each)
        assert is_free == (not found)
        clearance = checker.calc_robot_clearance(each, 0.0)
        rows = zip(clearance.pairs, clearance.distances, strict=True)
        deep = {pair: distance for pair, distance in rows if distance < 0.0}
        assert deep.keys() == {pair[:2] for pair in found}
        for first, second, _, _, distance in found:
            assert deep[first, second] == pytest.approx(distance, abs=1e-14)
        assert checker.classify_body_collisions(each) == oracle.types(each)
    return int(free.sum())


def test_paddings_of_single_pairs(cell, checker):
    """Random ones, also negative, on random configurations: pairs, depths and kinds agree."""
    rng, count = np.random.default_rng(1), len(checker.bodies)
    robots = sum(checker.is_part_of_robot(body) for body in checker.bodies)
    matrix = rng.uniform(-0.02, 0.08, (count, count))
    matrix += matrix.T
    np.fill_diagonal(matrix, 0.0)
    matrix[robots:, robots:] = 0.0
    checker.set_padding_matrix(matrix)
    np.testing.assert_array_equal(checker.get_padding_matrix(), matrix)
    off = ~np.eye(count, dtype=bool)
    off[robots:, robots:] = False
    assert checker.get_largest_padding() == matrix[off].max()
    assert 0 < agree(checker, Oracle(cell, checker), configurations(cell.tree, 25, 2)) < 25


def test_filters_that_change(cell, checker):
    """Pairs that are opened or closed, on random configurations; all back is as it was."""
    q = configurations(cell.tree, 25, 3)
    before, plan = checker.check_configs_collision_free(q), checker.plan
    nominal = checker.get_nominal_filtered_collision_matrix()
    checker.set_collision_filtered_between("panda_link5", "world", True)
    checker.set_collision_filtered_between("panda_link2", "panda_link4", False)
    checker.set_collision_filtered_between("panda_link0", "objects/ball", False)
    assert checker.is_collision_filtered_between("world", "panda_link5")
    assert not checker.is_collision_filtered_between("panda_link4", "panda_link2")
    matrix = checker.get_filtered_collision_matrix()
    assert np.count_nonzero(matrix != nominal) == 6
    np.testing.assert_array_equal(matrix, matrix.T)
    agree(checker, Oracle(cell, checker), q)
    checker.set_collision_filtered_with_all_bodies("panda_hand")
    assert all(checker.is_collision_filtered_between("panda_hand", b) for b in checker.bodies)
    agree(checker, Oracle(cell, checker), q)
    checker.set_collision_filter_matrix(nominal)
    np.testing.assert_array_equal(checker.check_configs_collision_free(q), before)
    assert checker.num_pairs == len(plan.pairs.bodies)


def test_added_shapes_are_as_registered_ones(cell, checker):
    """A box in the hand and a ball on the table against a scene that has both itself."""
    own = load_robot_diagram(CELL)
    inspector = own.context.inspector()
    X_WS = lifted(0.55)
    X_WS[0, 3] = 0.5
    for name, frame, shape, X in (
        ("box", own.frames["panda_hand"], POLE, lifted(0.15)),
        ("ball", inspector.world_frame_id(), Sphere(0.05), X_WS),
    ):
        instance = GeometryInstance(X, shape, name)
        instance.set_proximity_properties(ProximityProperties())
        source = inspector.get_owning_source_id(frame)
        own.scene_graph.register_geometry(source, frame, instance, context=own.context)
    q = configurations(cell.tree, 60, 4)
    alone = checker.check_configs_collision_free(q)
    assert checker.add_collision_shape_to_body("grasp", "panda_hand", POLE, lifted(0.15))
    assert checker.add_collision_shape_to_frame("things", "world", Sphere(0.05), X_WS)
    with_both = checker.check_configs_collision_free(q)
    assert (alone & ~with_both).any() and not (with_both & ~alone).any()
    # Filters of the hand hold for what is in it: the same bodies' filters are set there.
    other = SceneGraphCollisionChecker(own)
    other.set_collision_filter_matrix(checker.get_filtered_collision_matrix())
    assert other.num_pairs == checker.num_pairs
    np.testing.assert_array_equal(other.check_configs_collision_free(q), with_both)
    for each in q[:20]:
        first, second = (c.calc_robot_clearance(each, 0.1) for c in (checker, other))
        np.testing.assert_array_equal(np.sort(first.distances), np.sort(second.distances))
    edges = np.stack([q[:-1], q[1:]], axis=1)
    np.testing.assert_array_equal(checker.edge_statuses(edges), other.edge_statuses(edges))
    checker.remove_all_added_collision_shapes()
    np.testing.assert_array_equal(checker.check_configs_collision_free(q), alone)


def test_what_is_grasped_hits_and_is_proven(cell, checker):
    """A straight way that the robot may take alone, and not with what is in its hand."""
    q1 = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
    q2 = q1.copy()
    q2[1] += 0.8
    assert checker.measure_edge(q1, q2).status is EdgeStatus.FREE
    assert checker.add_collision_shape_to_body("grasp", "panda_hand", GRASPED, lifted(0.2))
    measure = checker.measure_edge(q1, q2)
    assert measure.status is EdgeStatus.COLLIDES and 0.0 < measure.alpha < 1.0
    inspector = checker.snapshot.inspector
    names = [inspector.get_name(each) for each in measure.pair]
    assert any(name.startswith("grasp/") for name in names)
    # Up to where it is proven, samples are free; where it collides, they do.
    along = q1 + np.linspace(0.0, measure.alpha, 300)[:-1, np.newaxis] * (q2 - q1)
    assert checker.check_configs_collision_free(along).all()
    assert not checker.check_config_collision_free(measure.configuration)
    goal = q1.copy()
    goal[0] += 0.9
    plan = plan_path(checker, q1, goal, timeout=20.0)
    assert plan.is_success
    starts, ends = plan.configurations[:-1], plan.configurations[1:]
    for start, end in zip(starts, ends, strict=True):
        way = start + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * (end - start)
        assert checker.check_configs_collision_free(way).all()


def test_groups_of_shapes(cell, checker):
    """Added together, listed, removed by name; ids stay what they are."""
    hand = BodyShapeDescription(GRASPED, lifted(0.2), "panda", "panda_hand")
    ball = BodyShapeDescription(Sphere(0.1), lifted(2.0), "objects", "ball")
    assert checker.add_collision_shapes({"a": [hand, ball], "b": [ball]}) == {"a": 2, "b": 1}
    assert checker.add_collision_shapes("b", [hand]) == 1
    added = checker.get_all_added_collision_shapes()
    assert {name: [d.body_name for d in each] for name, each in added.items()} == {
        "a": ["panda_hand", "ball"],
        "b": ["ball", "panda_hand"],
    }
    inspector = checker.snapshot.inspector
    ids = {inspector.get_name(i): i for i in inspector.get_all_geometry_ids(Role.PROXIMITY)}
    checker.remove_all_added_collision_shapes("a")
    checker.remove_all_added_collision_shapes("nobody's")
    assert list(checker.get_all_added_collision_shapes()) == ["b"]
    left = checker.snapshot.inspector.get_all_geometry_ids(Role.PROXIMITY)
    assert set(left) < set(ids.values())
    again = make_body_shape_description(checker.snapshot.inspector, max(left))
    assert again.model_instance_name == "panda" and again.body_name == "panda_hand"
    np.testing.assert_array_equal(again.pose_in_body, lifted(0.2))
    # A half space does not move with a robot; around it there may be one.
    assert not checker.add_collision_shape_to_body("c", "panda_hand", HalfSpace(), np.eye(4))
    assert checker.add_collision_shape_to_body("c", "world", HalfSpace(), lifted(-1.0))
    # Another moment has them, too.
    moved = checker.at(cell.context.snapshot)
    assert moved.num_pairs == checker.num_pairs
    q = configurations(cell.tree, 20, 6)
    np.testing.assert_array_equal(
        moved.check_configs_collision_free(q), checker.check_configs_collision_free(q)
    )


def test_uniform_paddings_between_links(checker):
    """Of all pairs of links, until one differs; those to what is around are others."""
    checker.set_padding_all_robot_robot_pairs(-0.01)
    assert checker.maybe_get_uniform_robot_robot_padding() == -0.01
    assert checker.get_padding_between("panda_link0", "panda_hand") == -0.01
    assert checker.maybe_get_uniform_robot_environment_padding() == 0.0
    assert checker.get_largest_padding() == 0.0
    checker.set_padding_all_robot_environment_pairs(-0.02)
    assert checker.get_largest_padding() == -0.01
    checker.set_padding_between("panda_hand", "panda_link0", 0.0)
    assert checker.maybe_get_uniform_robot_robot_padding() is None
    checker.set_padding_one_robot_body_all_environment_pairs("panda_hand", 0.1)
    assert checker.maybe_get_uniform_robot_environment_padding() is None


def test_uniform_paddings(tmp_path):
    """Of all pairs, of one body's; they hold where two balls touch."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    assert checker.maybe_get_uniform_robot_environment_padding() == 0.0
    checker.set_padding_all_robot_environment_pairs(0.05)
    assert checker.maybe_get_uniform_robot_environment_padding() == 0.05
    assert checker.maybe_get_uniform_robot_robot_padding() == 0.0
    assert checker.get_padding_between("ball", "ball") == 0.0
    assert checker.check_config_collision_free([0.65 - 1e-12])
    assert not checker.check_config_collision_free([0.65 + 1e-12])
    checker.set_padding_one_robot_body_all_environment_pairs("ball", 0.1)
    assert checker.get_largest_padding() == 0.1
    assert not checker.check_config_collision_free([0.6 + 1e-12])
    assert checker.measure_edge([0.0], [1.0]).alpha == pytest.approx(0.6, abs=2e-6)
    checker.set_padding_between("ball", "world", -0.05)
    assert checker.get_padding_between("world", "ball") == -0.05
    assert checker.check_config_collision_free([0.75 - 1e-12])
    assert not checker.check_config_collision_free([0.75 + 1e-12])


def test_bad_changes_are_named_and_change_nothing(tmp_path):
    """With the field and the value."""
    checker = SceneGraphCollisionChecker(two_slides(tmp_path))
    names = [body.name for body in checker.bodies]
    assert names == ["left/ball", "right/ball", "world"]
    plan, zeros = checker.plan, np.zeros((3, 3))
    filters = checker.get_filtered_collision_matrix()

    def refused(words, method, *arguments):
        with pytest.raises(CollisionCheckerError, match=words):
            getattr(checker, method)(*arguments)

    def changed(matrix, value, *entries):
        result = np.array(matrix, dtype=float)
        for entry in entries:
            result[entry] = value
        return result

    pair, pads = "set_padding_between", "set_padding_matrix"
    refused("padding must be a finite number, not nan", pair, "left/ball", "right/ball", math.nan)
    refused("bodyA and bodyB are both 'right/ball'", pair, "right/ball", 1, 0.1)
    refused(
        "bodyB: there is no body 'right/bal'; did you mean 'right/ball'",
        pair,
        "left/ball",
        "right/bal",
        0.1,
    )
    refused("bodyA: there is no body 3; there are 3", pair, 3, "right/ball", 0.1)
    refused("bodyA: there is no body True", pair, True, "right/ball", 0.1)
    refused(r"collision_padding must have shape \(3, 3\), not \(2, 2\)", pads, np.eye(2))
    refused("collision_padding must be numbers", pads, "wide")
    inf = changed(zeros, math.inf, (0, 1), (1, 0))
    refused("collision_padding of 'left/ball' and 'right/ball' must be finite, not inf", pads, inf)
    refused("both orders, not 0.5 and 0", pads, changed(zeros, 0.5, (0, 1)))
    refused("'right/ball' and 'right/ball' must be 0, not 0.5", pads, changed(zeros, 0.5, (1, 1)))
    refused("'world' and 'world' must be 0", pads, changed(zeros, 0.5, (2, 2)))
    one = "set_padding_one_robot_body_all_environment_pairs"
    refused("body 'world' is no part of a robot", one, "world", 0.1)
    one, between = "set_collision_filter_matrix", "set_collision_filtered_between"
    refused(
        "'left/ball' and 'right/ball' must be 0 or 1, not 2",
        one,
        changed(filters, 2, (0, 1), (1, 0)),
    )
    refused("must be a whole number, not 0.5", one, changed(filters, 0.5, (0, 1), (1, 0)))
    refused("'right/ball' and 'right/ball' must be -1, not 0", one, changed(filters, 0, (1, 1)))
    refused("both no part of a robot|are both 'world'", between, "world", "world", True)
    refused("filter_collision must be True or False, not 1", between, "left/ball", "right/ball", 1)
    refused("is no part of a robot", "set_collision_filtered_with_all_bodies", "world")
    add = "add_collision_shape_to_body"
    refused(
        "group_name must be text that is not empty: ' '", add, " ", "left/ball", GRASPED, np.eye(4)
    )
    refused("bodyA: there is no body 'x'", add, "a", "x", GRASPED, np.eye(4))
    refused("must be BodyShapeDescriptions, not 3", "add_collision_shapes", "a", [3])
    assert checker.plan is plan
    with pytest.raises(CollisionCheckerError, match="num_positions must not be negative: -1"):
        RobotClearance(-1)


def test_clearance_derivatives_to_1e_6(cell, checker):
    """Of pairs with one nearest pair of points, against central differences; rows by bodies."""
    checker.add_collision_shape_to_body("grasp", "panda_hand", Sphere(0.05), lifted(0.2))
    checker.set_padding_between("panda_hand", "world", 0.03)
    compared = 0
    for q in configurations(cell.tree, 6, 8):
        found = checker.calc_robot_clearance(q, 0.3)
        for robot, other, kind in zip(
            found.robot_indices, found.other_indices, found.collision_types, strict=True
        ):
            assert checker.is_part_of_robot(robot)
            is_own = kind is RobotCollisionType.SELF_COLLISION
            assert checker.is_part_of_robot(other) == is_own
        slopes = np.full((2, *found.jacobians.shape), np.nan)
        for column, (which, step) in itertools.product(
            range(cell.tree.num_positions), enumerate((1e-5, 2e-5))
        ):
            ends = []
            for sign in (-1.0, 1.0):
                moved = q.copy()
                moved[column] += sign * step
                there = checker.calc_robot_clearance(moved, 0.4)
                ends.append(dict(zip(there.pairs, there.distances, strict=True)))
            slopes[which, :, column] = [
                (ends[1][pair] - ends[0][pair]) / (2.0 * step) for pair in found.pairs
            ]
        # Where witness points jump the two differences disagree: nothing is known there.
        smooth = (np.abs(slopes[1] - slopes[0]) < 1e-8).all(axis=1)
        off = np.abs(found.jacobians - slopes[0]).max(axis=1)
        assert (off[smooth] < 1e-6).all()
        compared += int(smooth.sum())
    assert compared > 60


def test_what_is_running_keeps_its_own(cell, checker):
    """Answers while another thread changes filters are those of before or those of after."""
    q = configurations(cell.tree, 40, 9)
    world = checker.get_body("world")
    links = [b.index for b in checker.bodies if checker.is_part_of_robot(b)]
    everything = checker.get_filtered_collision_matrix()
    nothing = everything.copy()
    nothing[links, world.index] = nothing[world.index, links] = 1
    answers = []
    for filters in (everything, nothing):
        checker.set_collision_filter_matrix(filters)
        answers.append((checker.check_configs_collision_free(q), checker.clone()))
    (one, _), (two, kept) = answers
    assert (one != two).any()
    done = []

    def change():
        while not done:
            checker.set_collision_filter_matrix(everything)
            checker.set_collision_filter_matrix(nothing)

    thread = Thread(target=change)
    thread.start()
    try:
        for _ in range(60):
            free = checker.check_configs_collision_free(q, threads=2)
            assert np.array_equal(free, one) or np.array_equal(free, two)
            found = checker.find_collisions(q)
            assert len(found.depths) in ((~one).sum(), (~two).sum())
            assert (found.depths > 0.0).all()
            np.testing.assert_array_equal(kept.check_configs_collision_free(q), two)
    finally:
        done.append(True)
        thread.join()
