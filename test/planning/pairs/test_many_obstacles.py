"""Robots among hundreds of things, most of which a tree leaves out: the scene has the answers."""

import numpy as np
import pytest
from robot_scenes import move

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.planning import EdgeStatus, RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.planning.pairs.static_tree import FEWEST, static_nodes
from scene_graph_ros.scene_files import load_srdf, load_urdf, register_robot

PANDA = "package://example-robot-data/robots/panda_description"
COUNT = 400


def random_pose(rng, lower, upper):
    """Return a pose anywhere in a box."""
    X = np.eye(4)
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    X[:3, :3] = Q * np.sign(np.diag(R))
    X[:3, 2] *= np.linalg.det(X[:3, :3])
    X[:3, 3] = rng.uniform(lower, upper)
    return X


def random_shape(rng):
    """Return one of five kinds, of some centimetres, now and then a long one."""
    a, b, c = rng.uniform(0.01, 0.05, 3)
    if rng.uniform() < 0.05:
        a *= 20.0
    shapes = (
        Sphere(min(a, 0.05)),
        Box(2.0 * a, 2.0 * b, 2.0 * c),
        Capsule(b, 2.0 * a),
        Cylinder(b, 2.0 * a),
        Ellipsoid(a, b, c),
    )
    return shapes[rng.integers(len(shapes))]


@pytest.fixture(scope="module")
def robots():
    """A Panda among 400 random things over a floor."""
    model = load_urdf(f"{PANDA}/urdf/panda.urdf")
    semantics = load_srdf(f"{PANDA}/srdf/panda.srdf", model)
    scene_graph, rng = SceneGraph(), np.random.default_rng(5)
    source = scene_graph.register_source("panda")
    frames = register_robot(model, scene_graph, source, semantics=semantics, visual=False)
    things = [GeometryInstance(np.eye(4), HalfSpace(), "floor")]
    things[0] = GeometryInstance(
        np.block([[np.eye(3), np.array([[0.0], [0.0], [-0.02]])], [0.0, 0.0, 0.0, 1.0]]),
        HalfSpace(),
        "floor",
    )
    while len(things) <= COUNT:
        X = random_pose(rng, [-1.2, -1.2, 0.0], [1.2, 1.2, 1.5])
        if np.hypot(X[0, 3], X[1, 3]) > 0.3:
            things.append(GeometryInstance(X, random_shape(rng), f"thing_{len(things)}"))
    for thing in things:
        thing.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, thing)
    tree = model.kinematic_tree(semantics)
    return RobotDiagram(scene_graph, scene_graph.create_default_context(), tree, frames)


def configurations(robots, count, seed):
    """Return random configurations ``(count, nq)``."""
    tree = robots.tree
    rng = np.random.default_rng(seed)
    return rng.uniform(tree.lower, tree.upper, (count, tree.num_positions))


def without_tree(robots, monkeypatch, **options):
    """Return a checker that looks at all pairs one by one."""
    with monkeypatch.context() as patched:
        patched.setattr("scene_graph_ros.planning.pairs.static_tree.FEWEST", 10**9)
        checker = SceneGraphCollisionChecker(robots, **options)
    assert not len(checker.plan.bodies.nodes.radii)
    return checker


def test_what_collides_is_what_the_scene_says(robots):
    """The scene's own queries, asked of each configuration, know no such tree."""
    checker, q = SceneGraphCollisionChecker(robots), configurations(robots, 150, 1)
    assert len(checker.plan.bodies.nodes.radii) == 2 * COUNT - 1
    found = checker.check_configs_collision_free(q)
    assert 20 < found.sum() < 130
    for free, each in zip(found, q, strict=True):
        assert move(robots, each).has_collisions() == (not free)


@pytest.mark.parametrize("padding", [0.0, 0.03, -0.01])
def test_all_answers_are_those_of_looking_at_all_pairs(robots, monkeypatch, padding):
    """Free or not, the pair, the rows of clearances; whether edges are free, and up to where."""
    options = {"env_collision_padding": padding, "self_collision_padding": 0.5 * padding}
    by_tree = SceneGraphCollisionChecker(robots, **options)
    by_all = without_tree(robots, monkeypatch, **options)
    hand = by_tree.get_body("panda_hand").index
    other = by_tree.get_body("panda_link4").index
    world = next(body.index for body in by_tree.bodies if body.body_name == "world")
    for checker in (by_tree, by_all):
        checker.set_padding_between(hand, world, padding + 0.05)
        checker.set_collision_filtered_between(other, world, filter_collision=True)
    q = configurations(robots, 300, 2)
    free = by_tree.check_configs_collision_free(q)
    assert 0.03 < free.mean() < 0.97
    np.testing.assert_array_equal(free, by_all.check_configs_collision_free(q))
    np.testing.assert_array_equal(free, by_tree.check_configs_collision_free(q, threads=2))
    for each in q[:60]:
        assert by_tree.find_colliding_pair(each) == by_all.find_colliding_pair(each)
        one, two = (c.calc_robot_clearance(each, 0.08) for c in (by_tree, by_all))
        assert one.pairs == two.pairs
        np.testing.assert_array_equal(one.distances, two.distances)
        np.testing.assert_array_equal(one.jacobians, two.jacobians)
    ends = q[free]
    ways = ends[1:] - ends[:-1]
    ways *= np.minimum(1.0, 0.4 / np.linalg.norm(ways, axis=1))[:, np.newaxis]
    edges = np.stack([ends[:-1], ends[:-1] + ways], axis=1)
    one, two = (c.measure_edges(edges) for c in (by_tree, by_all))
    statuses = [each.status for each in one]
    assert statuses == [each.status for each in two]
    assert {EdgeStatus.FREE, EdgeStatus.COLLIDES} <= set(statuses)
    assert [each.alpha for each in one] == pytest.approx([each.alpha for each in two], abs=1e-6)


def test_what_a_proof_keeps_is_kept(robots):
    """No configuration on a free edge is nearer to anything than its least clearance."""
    checker, q = SceneGraphCollisionChecker(robots), configurations(robots, 400, 3)
    ends = q[checker.check_configs_collision_free(q)]
    ways = ends[1:] - ends[:-1]
    ways *= np.minimum(1.0, 0.3 / np.linalg.norm(ways, axis=1))[:, np.newaxis]
    edges = np.stack([ends[:-1], ends[:-1] + ways], axis=1)
    measured = 0
    for edge, measure in zip(edges, checker.measure_edges(edges), strict=True):
        if measure.status is not EdgeStatus.FREE:
            continue
        for ratio in np.linspace(0.0, 1.0, 21):
            near = checker.calc_robot_clearance((1.0 - ratio) * edge[0] + ratio * edge[1], 0.1)
            kept = min(measure.least_clearance, 0.1) - 1e-12  # some pairs do not move: rounding
            assert near.distances.min(initial=0.1) >= kept
        measured += 1
    assert measured > 20


def test_what_has_moved_is_found_where_it_is(tmp_path):
    """Balls on frames of their own that are moved: the tree is made anew for that moment."""
    from robot_scenes import diagram, SLIDE

    text = "frames:\n" + "".join(
        f"  - {{name: f{k}, source: around, pose: {{xyz: [{k}, 5, 0]}}}}\n" for k in range(FEWEST)
    )
    text += "geometries:\n" + "".join(
        f"  - {{name: b{k}, source: around, frame: f{k}, shape: {{type: sphere, radius: 0.2}}}}\n"
        for k in range(FEWEST)
    )
    robots = diagram(tmp_path, SLIDE, text)
    checker = SceneGraphCollisionChecker(robots)
    assert len(checker.plan.bodies.nodes.radii) == 2 * FEWEST - 1
    q = np.linspace(-8.95, 8.95, 180)[:, np.newaxis]
    assert checker.check_configs_collision_free(q).all()
    inspector = robots.context.inspector()
    sources = {inspector.get_source_name(each): each for each in inspector.get_all_source_ids()}
    X = np.tile(np.eye(4), (FEWEST, 1, 1))
    X[:, :3, 3] = [0.0, 5.0, 0.0]
    X[7, :3, 3] = [2.0, 0.0, 0.0]
    robots.context.set_frame_poses(sources["around"], X)
    moved = checker.at(robots.context.snapshot)
    found = moved.check_configs_collision_free(q)
    np.testing.assert_array_equal(found, np.abs(q[:, 0] - 2.0) > 0.3)


@pytest.mark.parametrize("count", [FEWEST, FEWEST + 1, 63, 64, 65, 1000])
def test_balls_are_in_the_balls_above_them(count):
    """And each body is in one leaf, which is reached by going on, and left out by a skip."""
    rng = np.random.default_rng(count)
    centers, radii = rng.normal(size=(count, 3)), rng.uniform(0.0, 0.3, count)
    centers[: count // 4] = centers[0]  # many at one place
    bodies = rng.permutation(count) + 5
    nodes = static_nodes(bodies, centers, radii)
    of_body = dict(zip(bodies.tolist(), range(count), strict=True))
    assert sorted(nodes.bodies[nodes.bodies >= 0].tolist()) == sorted(of_body)
    above: list[int] = []
    for row in range(len(nodes.skips)):
        while above and row >= nodes.skips[above[-1]]:
            above.pop()
        body = int(nodes.bodies[row])
        if body >= 0:
            assert nodes.skips[row] == row + 1
            k = of_body[body]
            for node in (*above, row):
                far = np.linalg.norm(centers[k] - nodes.centers[node]) + radii[k]
                assert far <= nodes.radii[node] * (1.0 + 1e-12)
        above.append(row)
    assert nodes.skips[0] == len(nodes.skips) == 2 * count - 1
