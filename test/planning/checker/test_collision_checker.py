"""Configurations and edges that are free, against the scene's own queries, and by construction."""

import math

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, move, PLATE, ROD, SLIDE

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.planning import (
    CollisionCheckerError,
    EdgeStatus,
    load_robot_diagram,
    RobotDiagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots import KinematicTreeError
from scene_graph_ros.scene_files import load_scene_text

CELL = "config/scenes/panda_cell.yaml"


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return load_robot_diagram(CELL)


@pytest.fixture(scope="module")
def checker(cell):
    """Its checker."""
    return SceneGraphCollisionChecker(cell)


def configurations(tree, count, seed=0):
    """Return random configurations within limits."""
    rng = np.random.default_rng(seed)
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    return rng.uniform(lower, upper, (count, tree.num_positions))


def test_a_panda_collides_where_the_scene_says_so(cell, checker):
    """On 200 random configurations; what always touches, as the base its pedestal, is no pair."""
    q = configurations(cell.tree, 200)
    free = checker.check_configs_collision_free(q)
    moving = {tuple(sorted(map(int, checker.plan.ids(pair)))) for pair in range(checker.num_pairs)}
    for each, is_free in zip(q, free, strict=True):
        found = move(cell, each).compute_point_pair_penetration()
        pairs = {tuple(sorted((int(p.id_A), int(p.id_B)))) for p in found}
        assert bool(pairs & moving) != is_free
        pair = checker.find_colliding_pair(each)
        assert (pair is None) == is_free
        assert pair is None or tuple(sorted(map(int, pair))) in pairs
    assert 0.2 < free.mean() < 0.95


def test_batches_single_ones_and_threads_agree(cell, checker):
    """Bit for bit, also where blocks end."""
    q = configurations(cell.tree, 150, seed=1)
    free = checker.check_configs_collision_free(q)
    np.testing.assert_array_equal(checker.check_configs_collision_free(q, threads=3), free)
    assert [checker.check_config_collision_free(each) for each in q[:20]] == free[:20].tolist()
    edges = np.stack([q[:-1], q[1:]], axis=1)
    proven = checker.check_edges_collision_free(edges)
    np.testing.assert_array_equal(checker.check_edges_collision_free(edges, threads=2), proven)


def test_no_proven_edge_of_a_panda_collides(cell, checker):
    """None of 400 configurations along each of 150 edges; and most that are free are proven."""
    q = configurations(cell.tree, 300, seed=2)
    q = q[checker.check_configs_collision_free(q)]
    step = q[1:151] - q[:150]
    step *= np.minimum(1.0, 1.25 / np.linalg.norm(step, axis=1))[:, np.newaxis]
    measured = checker.measure_edges(np.stack([q[:150], q[:150] + step], axis=1))
    t = np.linspace(0.0, 1.0, 400)[:, np.newaxis]
    free = 0
    for start, way, measure in zip(q, step, measured, strict=False):
        along = checker.check_configs_collision_free(start + measure.alpha * t * way)
        if measure.status is EdgeStatus.FREE:
            assert measure.completely_free and measure.alpha == 1.0
            assert along.all()
            free += 1
        elif measure.status is EdgeStatus.COLLIDES:
            assert not checker.check_config_collision_free(measure.configuration)
            # Up to alpha all is free, but for what alpha was rounded by.
            assert along[:-1].all()
            beyond = start + min(measure.alpha + 1e-2, 1.0) * way
            assert measure.alpha < 1.0 and np.isfinite(beyond).all()
        else:
            assert along[:-1].all()
    assert free >= 0.97 * sum(m.status is not EdgeStatus.COLLIDES for m in measured)
    assert 0 < free < 150


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-2.0, 2.5), (0.5 - 1e-3, 0.9), (0.2, 7.0)])
def test_a_thin_plate_between_samples_is_found(tmp_path, ends):
    """A rod sweeps over a plate of 0.1 mm: samples 0.05 apart miss it, the proof does not."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    measure = checker.measure_edge([ends[0]], [ends[1]])
    assert measure.status is EdgeStatus.COLLIDES
    assert not checker.check_edge_collision_free([ends[0]], [ends[1]])
    assert not checker.check_config_collision_free(measure.configuration)
    # The rod's half thickness, at the plate's near end 0.7 m from the hinge, is 0.8 mrad.
    reached = ends[0] + measure.alpha * (ends[1] - ends[0])
    assert reached == pytest.approx(0.5 - (0.0005 + 0.00005) / 0.7, abs=5e-5)
    assert [int(each) for each in measure.pair] == sorted(int(each) for each in measure.pair)


def test_samples_are_asked_for(tmp_path):
    """The proof is what is asked without a word; both ways refuse ends that do not fit."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    assert not checker.check_edge([0.01], [1.01])
    assert checker.check_edge([0.01], [1.01], proof=False)
    assert not checker.measure_edge([0.01], [1.01]).proven
    assert checker.check_edge([0.0], [0.4])
    assert checker.measure_edge([0.0], [0.4]).proven
    undecided = checker.measure_edge([0.4], [0.5 - 0.00055 / 0.7 - 1e-7])
    assert undecided.status is EdgeStatus.UNDECIDED and not undecided.proven
    for proof in (True, False):
        with pytest.raises(CollisionCheckerError, match="q1 and q2 must have the same shape"):
            checker.check_edge([0.0], [0.0, 1.0], proof=proof)


def test_an_edge_beside_the_plate_is_proven(tmp_path):
    """Up to 1 mrad before it; a tenth of a micrometre before it is below the tolerance."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    touching = 0.5 - (0.0005 + 0.00005) / 0.7
    measure = checker.measure_edge([-1.0], [touching - 1e-3])
    assert measure.completely_free
    assert 0.0 < measure.least_clearance <= 0.7e-3
    assert measure.configuration is None and measure.pair is None


def test_a_ball_on_a_rail_stops_where_it_touches(tmp_path):
    """Two balls of 0.1 and 0.2 m whose centres come from 1 m apart: free up to q = 0.7."""
    robot = diagram(tmp_path, SLIDE, BALL)
    checker = SceneGraphCollisionChecker(robot)
    measure = checker.measure_edge([0.0], [1.0])
    assert measure.status is EdgeStatus.COLLIDES
    assert measure.alpha == pytest.approx(0.7, abs=2e-6)
    assert measure.distance == 1.0
    assert checker.check_edge_collision_free([0.0], [0.69])
    # Closer than the tolerance it is undecided, and counts as not free.
    near = checker.measure_edge([0.0], [0.7 - 1e-7])
    assert near.status is EdgeStatus.UNDECIDED and not near.completely_free
    assert near.alpha * (0.7 - 1e-7) == pytest.approx(0.7 - 1e-6, abs=1e-6)
    # What touches exactly does not collide; a padding is kept, a negative one may be used up.
    assert checker.check_config_collision_free([0.7])
    assert not checker.check_config_collision_free([0.7 + 1e-12])
    padded = SceneGraphCollisionChecker(robot, env_collision_padding=0.05)
    assert padded.check_config_collision_free([0.65 - 1e-12])
    assert not padded.check_config_collision_free([0.65 + 1e-12])
    assert padded.measure_edge([0.0], [1.0]).alpha == pytest.approx(0.65, abs=2e-6)
    allowed = SceneGraphCollisionChecker(robot, env_collision_padding=-0.05)
    assert allowed.check_config_collision_free([0.75 - 1e-12])
    assert not allowed.check_config_collision_free([0.75 + 1e-12])
    assert allowed.measure_edge([0.0], [1.0]).alpha == pytest.approx(0.75, abs=2e-6)
    own = SceneGraphCollisionChecker(robot, self_collision_padding=0.5)
    assert own.check_config_collision_free([0.69])


def test_clearances_and_their_derivatives(tmp_path, cell, checker):
    """Of the balls by construction, of a Panda against central differences."""
    robot = diagram(tmp_path, SLIDE, BALL)
    found = SceneGraphCollisionChecker(robot, env_collision_padding=0.05).calc_robot_clearance(
        [0.5], 0.3
    )
    np.testing.assert_allclose(found.distances, [0.15], atol=1e-15)
    np.testing.assert_allclose(found.jacobians, [[-1.0]], atol=1e-15)
    far = SceneGraphCollisionChecker(robot).calc_robot_clearance([0.0], 0.3)
    assert far.pairs == () and far.jacobians.shape == (0, 1)
    q, step = configurations(cell.tree, 1, seed=5)[0], 1e-7
    found = checker.calc_robot_clearance(q, 0.4)
    assert len(found.pairs) > 10
    for column in range(cell.tree.num_positions):
        ends = []
        for sign in (-1.0, 1.0):
            moved = q.copy()
            moved[column] += sign * step
            there = checker.calc_robot_clearance(moved, 0.5)
            ends.append(dict(zip(there.pairs, there.distances, strict=True)))
        slopes = [(ends[1][p] - ends[0][p]) / (2.0 * step) for p in found.pairs]
        # A few pairs have witness points that jump; all others agree.
        off = np.abs(found.jacobians[:, column] - slopes) > 1e-5
        assert off.mean() < 0.1


def test_a_drone_turns_the_short_way(tmp_path):
    """Quaternions of any sign and length; a half turn about z sweeps a circle of 0.206 m."""
    post = """
geometries:
  - name: post
    source: around
    pose: {xyz: [0, %s, 0]}
    shape: {type: cylinder, radius: 0.01, length: 1}
"""
    start = [1.0, 0, 0, 0, 0, 0, 0]
    end = [0.0, 0, 0, -2.0, 0, 0, 0]
    hits = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, post % 0.2))
    measure = hits.measure_edge(start, end)
    assert measure.status is EdgeStatus.COLLIDES
    # It turns clockwise, and the post is in its way after nearly a quarter turn.
    assert 0.3 < measure.alpha < 0.5
    misses = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, post % 0.22))
    assert misses.check_edge_collision_free(start, end)
    assert misses.check_edge_collision_free(start, [-1.0, 0, 0, 0, 0, 0, 0])


def test_edges_of_no_length_and_batches_of_none(tmp_path):
    """A point is an edge; none is an answer."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    assert checker.measure_edge([0.3], [0.3]).completely_free
    stuck = checker.measure_edge([0.9], [0.9])
    assert stuck.status is EdgeStatus.COLLIDES and stuck.alpha == -1.0
    assert checker.check_edges_collision_free(np.empty((0, 2, 1))).shape == (0,)
    assert checker.check_configs_collision_free(np.empty((0, 1))).shape == (0,)


@pytest.mark.parametrize("far", [1e3, 1e9, 1e12])
def test_edges_across_the_world_have_an_answer(tmp_path, far):
    """A ball that goes through another one on its way, however long that is, is found or open."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    measure = checker.measure_edge([-far], [far])
    assert measure.status in (EdgeStatus.COLLIDES, EdgeStatus.UNDECIDED)
    assert 0.4 < measure.alpha < 0.6
    assert checker.measure_edge([-far], [-1.0]).completely_free
    assert not checker.check_edge_collision_free([-far], [far])


def test_two_robots_in_one_configuration(tmp_path):
    """Names begin with the robot's; they are checked against each other."""
    (tmp_path / "slide.urdf").write_text(SLIDE)
    (tmp_path / "two.yaml").write_text(
        "version: 1\nrobots:\n  - {name: left, urdf: slide.urdf}\n  - name: right\n"
        "    urdf: slide.urdf\n    base: {xyz: [1, 0, 0], rpy: [0, 0, 3.14159265358979]}\n"
    )
    robots = load_robot_diagram(tmp_path / "two.yaml")
    assert robots.tree.position_names == ("left/rail", "right/rail")
    checker = SceneGraphCollisionChecker(robots)
    # Centres 1 - 0.4 - q apart, radii 0.1 each.
    assert checker.measure_edge([0.4, 0.0], [0.4, 1.0]).alpha == pytest.approx(0.4, abs=2e-6)
    padded = SceneGraphCollisionChecker(robots, self_collision_padding=0.1)
    assert padded.measure_edge([0.4, 0.0], [0.4, 1.0]).alpha == pytest.approx(0.3, abs=2e-6)


def test_bad_arguments_are_named(tmp_path):
    """With the field and the value."""
    robot = diagram(tmp_path, SLIDE, BALL)
    checker = SceneGraphCollisionChecker(robot)
    for field in ("env_collision_padding", "self_collision_padding", "tolerance"):
        with pytest.raises(CollisionCheckerError, match=f"{field} must be a finite number"):
            SceneGraphCollisionChecker(robot, **{field: math.nan})
    with pytest.raises(CollisionCheckerError, match="tolerance must be positive, not 0"):
        SceneGraphCollisionChecker(robot, tolerance=0)
    with pytest.raises(CollisionCheckerError, match=r"q must have shape \(nq,\), not \(1, 1\)"):
        checker.check_config_collision_free([[0.0]])
    with pytest.raises(KinematicTreeError, match="'rail' of configuration 1 must be finite"):
        checker.check_edge_collision_free([0.0], [math.inf])
    with pytest.raises(CollisionCheckerError, match=r"'rail' of configuration 0 is beyond 1e\+"):
        checker.check_config_collision_free([1e300])
    many = np.zeros((500, 1))
    for value, error, words in (
        (math.nan, KinematicTreeError, "'rail' of configuration 321 must be finite, not nan"),
        (-2e12, CollisionCheckerError, r"'rail' of configuration 321 is beyond 1e\+"),
    ):
        many[321] = value
        with pytest.raises(error, match=words):
            checker.check_configs_collision_free(many)
    with pytest.raises(CollisionCheckerError, match=r"shape \(n, 2, 1\), or .*, not \(3, 1\)"):
        checker.check_edges_collision_free(np.zeros((3, 1)))
    with pytest.raises(CollisionCheckerError, match="influence_distance must not be negative"):
        checker.calc_robot_clearance([0.0], -1.0)
    with pytest.raises(KinematicTreeError, match="no robot to plan for"):
        RobotDiagram.of_scene(SceneGraph(), load_scene_text("version: 1").apply(SceneGraph()))
