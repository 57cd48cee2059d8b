"""Distances of configurations and what is between them, by closed forms and by rules."""

from concurrent.futures import ThreadPoolExecutor
import math
import threading

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    DistanceAndInterpolationProvider,
    EdgeStatus,
    LinearDistanceAndInterpolationProvider,
    load_robot_diagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.checker.distance_and_interpolation import FunctionsProvider


class Detour(DistanceAndInterpolationProvider):
    """Along a parabola of one position, as high as asked for."""

    def __init__(self, height, row=0):
        self.height, self.row = height, row

    def _do_compute_configuration_distance(self, q1, q2):
        return float(np.abs(q2 - q1).sum())

    def _do_interpolate_between_configurations(self, q1, q2, ratio):
        result = (1.0 - ratio) * q1 + ratio * q2
        if not (q1 == q2).all():
            result[self.row] += 4.0 * self.height * ratio * (1.0 - ratio)
        return result


def turned(angle, x=0.0):
    """Return a drone's configuration, turned about z and moved along x."""
    return np.array([math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2), x, 0.0, 0.0])


POST = """
geometries:
  - name: post
    source: around
    pose: {xyz: [1.57, %s, 0]}
    shape: {type: cylinder, radius: 0.1, length: 1}
"""
Y = 5
"""The drone's position that goes sideways."""


@pytest.fixture(name="drone")
def drone_tree(tmp_path):
    """One floating joint."""
    return diagram(tmp_path, DRONE).tree


@pytest.fixture(name="cell", scope="module")
def panda_cell():
    """A Panda between a table and a shelf."""
    return load_robot_diagram("config/scenes/panda_cell.yaml")


@pytest.fixture(name="panda", scope="module")
def panda_tree(cell):
    """Seven joints and a finger that another one follows."""
    return cell.tree


def test_distances_are_weighted_norms(panda):
    """By hand: weights of all, of some joints by name, and none."""
    q1, q2 = np.zeros(8), np.arange(8.0)
    provider = LinearDistanceAndInterpolationProvider(panda)
    assert provider.distance_weights.tolist() == [1.0] * 8
    assert provider.quaternion_dof_start_indices == ()
    assert provider.compute_configuration_distance(q1, q2) == pytest.approx(math.sqrt(140.0))
    named = LinearDistanceAndInterpolationProvider(
        panda, {"panda_joint2": 3.0, "panda_joint3": [0.0]}
    )
    # 1^2 3^2 for joint 2, nothing for joint 3: 140 + 8 - 4.
    assert named.compute_configuration_distance(q1, q2) == pytest.approx(12.0)
    every = LinearDistanceAndInterpolationProvider(panda, 2.0 * np.ones(8))
    assert every.compute_configuration_distance(q1, q2) == pytest.approx(2.0 * math.sqrt(140.0))
    with pytest.raises(ValueError, match="read-only"):
        every.distance_weights[0] = 1.0


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, 3.0, math.pi])
def test_a_floating_joint_is_as_far_as_it_turns(drone, angle):
    """The angle, of quaternions of any sign and length; with what it moves, by Pythagoras."""
    provider = LinearDistanceAndInterpolationProvider(drone)
    assert provider.quaternion_dof_start_indices == (0,)
    assert provider.distance_weights.tolist() == [1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    for sign in (1.0, -1.0, 3.0):
        end = turned(angle, 2.0)
        end[:4] *= sign
        far = provider.compute_configuration_distance(turned(0.0, 2.0), end)
        assert far == pytest.approx(angle, rel=1e-9, abs=1e-15)
    far = provider.compute_configuration_distance(turned(0.0), turned(angle, 2.0))
    assert far == pytest.approx(math.hypot(angle, 2.0))
    heavy = LinearDistanceAndInterpolationProvider(drone, {"free": 5.0})
    far = heavy.compute_configuration_distance(turned(0.0), turned(angle, 2.0))
    assert far == pytest.approx(5.0 * math.hypot(angle, 2.0))


def test_ends_and_what_stays_are_exact(panda, drone):
    """Bit for bit, on random configurations; between, at equal parts of the distance."""
    rng = np.random.default_rng(0)
    for tree in (panda, drone):
        provider = LinearDistanceAndInterpolationProvider(tree)
        for _ in range(50):
            q1, q2 = rng.uniform(-2.0, 2.0, (2, tree.num_positions))
            assert (provider.interpolate_between_configurations(q1, q2, 0.0) == q1).all()
            assert (provider.interpolate_between_configurations(q1, q2, 1) == q2).all()
            ratio = rng.uniform()
            assert (provider.interpolate_between_configurations(q1, q1, ratio) == q1).all()
            assert provider.compute_configuration_distance(q1, q1) == 0.0
            far = provider.compute_configuration_distance(q1, q2)
            between = provider.interpolate_between_configurations(q1, q2, ratio)
            part = provider.compute_configuration_distance(q1, between)
            assert part == pytest.approx(ratio * far, rel=1e-9)


def test_weights_are_refused_by_name(panda, drone):
    """With the joint or position and the value."""
    make = LinearDistanceAndInterpolationProvider
    for weights, match in (
        (np.ones(7), r"distance_weights must have shape \(8,\), not \(7,\)"),
        ([1.0] * 7 + [math.inf], r"distance_weights\[7\] must be finite, not inf"),
        ([1.0] * 7 + [-2.0], "'panda_finger_joint1' must be finite and not negative, not -2.0"),
        ({"panda_joint9": 1.0}, "there is no joint 'panda_joint9'"),
        ({"panda_finger_joint2": 1.0}, "there is no joint 'panda_finger_joint2' with positions"),
        ({"panda_joint1": [1.0, 1.0]}, r"'panda_joint1' must have shape \(1,\), not \(2,\)"),
        ({"panda_joint1": "heavy"}, "'panda_joint1' must be numbers: 'heavy'"),
        ({"panda_joint1": math.nan}, "'panda_joint1' must be finite and not negative, not nan"),
    ):
        with pytest.raises(CollisionCheckerError, match=match):
            make(panda, weights)
    with pytest.raises(CollisionCheckerError, match=r"must be 0, not 1\.0: only the first"):
        make(drone, np.ones(7))


def test_what_is_asked_and_answered_is_checked(panda):
    """Ratios, shapes, numbers; and what a provider of one's own returns."""
    provider = LinearDistanceAndInterpolationProvider(panda)
    zero = np.zeros(8)
    for ratio in (-0.1, 1.1, math.nan, "half"):
        with pytest.raises(CollisionCheckerError, match="ratio must be from 0 to 1, not"):
            provider.interpolate_between_configurations(zero, zero, ratio)
    with pytest.raises(CollisionCheckerError, match=r"same shape, not \(8,\) and \(7,\)"):
        provider.compute_configuration_distance(zero, zero[1:])
    with pytest.raises(CollisionCheckerError, match=r"q2\[1\] must be finite, not nan"):
        provider.compute_configuration_distance(zero, [0.0, math.nan] + [0.0] * 6)

    class Bad(Detour):
        def _do_compute_configuration_distance(self, q1, q2):
            q1[0] = 7.0
            return -1.0

        def _do_interpolate_between_configurations(self, q1, q2, ratio):
            return q1[1:]

    with pytest.raises(CollisionCheckerError, match=r"finite and not negative, not -1\.0"):
        Bad(1.0).compute_configuration_distance(zero, zero)
    assert not zero.any()
    with pytest.raises(CollisionCheckerError, match=r"must have shape \(8,\), not \(7,\)"):
        Bad(1.0).interpolate_between_configurations(zero, zero, 0.5)


def test_ways_of_a_provider_are_what_is_proven(tmp_path):
    """A drone of 0.4 m flies past a post, or into it where its front is at 1.57 - 0.1 m."""
    ends = turned(0.0, 0.0), turned(0.0, 3.0)
    ahead = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, POST % 0.0))
    assert not ahead.check_edge_collision_free(*ends)
    assert ahead.measure_edge(*ends).alpha == pytest.approx(1.27 / 3.0, abs=1e-5)
    aside = SceneGraphCollisionChecker(
        diagram(tmp_path, DRONE, POST % 0.5),
        distance_and_interpolation_provider=Detour(0.5, Y),
    )
    measure = aside.measure_edge(*ends)
    assert not aside.check_edge_collision_free(*ends)
    assert measure.status is EdgeStatus.COLLIDES
    assert measure.alpha == pytest.approx(1.27 / 3.0, abs=1e-5)
    assert measure.distance == 3.0
    assert measure.partially_free and measure.alpha <= measure.at
    assert not aside.check_config_collision_free(measure.configuration)
    ahead.set_distance_and_interpolation_provider(Detour(0.5, Y))
    aside.set_distance_and_interpolation_provider(
        LinearDistanceAndInterpolationProvider(aside.model.tree)
    )
    for checker in (ahead, aside):
        assert checker.check_edge_collision_free(*ends)
        assert checker.measure_edge(*ends).completely_free
        assert checker.measure_edge(*ends).least_clearance > 0.0
    # From within the post there is no such part.
    stuck = ahead.measure_edge(turned(0.0, 1.57), ends[1])
    assert (stuck.alpha, stuck.partially_free, stuck.alpha_or(0.25)) == (-1.0, False, 0.25)
    assert ahead.measure_edges(np.empty((0, 2, 7))) == []


def test_no_proven_way_of_a_panda_collides(cell):
    """200 random ways with bends: at 20 configurations on each piece; in batches and measures."""
    checker = SceneGraphCollisionChecker(
        cell, distance_and_interpolation_provider=Detour(0.6, 3), edge_step_size=1.0
    )
    rng = np.random.default_rng(3)
    first = rng.uniform(cell.tree.lower, cell.tree.upper, (200, 8))
    first = first[checker.check_configs_collision_free(first)]
    edges = np.stack([first, first + rng.uniform(-0.6, 0.6, first.shape)], axis=1)
    statuses = checker.edge_statuses(edges)
    measures = checker.measure_edges(edges, threads=2)
    assert [each.status.value for each in measures] == statuses.tolist()
    pieces_of_free = 0
    for edge, measure in zip(edges, measures, strict=True):
        way = checker.way(*edge)
        along = np.linspace(0.0, len(way) - 1, (len(way) - 1) * 20)
        q = np.stack([np.interp(along, np.arange(len(way)), column) for column in way.T], axis=1)
        share = along / (len(way) - 1)
        free = checker.check_configs_collision_free(q)
        assert free[share <= measure.alpha].all()
        if measure.completely_free:
            pieces_of_free += len(way) - 1
        elif measure.status is EdgeStatus.COLLIDES:
            assert not checker.check_config_collision_free(measure.configuration)
    assert pieces_of_free > 50


def test_edges_have_the_same_answers_by_all_names(tmp_path):
    """One alone, in threads, in a batch and with a context; of a straight and of a curved way."""
    robots = diagram(tmp_path, SLIDE, BALL)
    curved = SceneGraphCollisionChecker(
        robots, distance_and_interpolation_provider=Detour(0.1), edge_step_size=0.01
    )
    for checker in (SceneGraphCollisionChecker(robots), curved):
        context = checker.make_standalone_model_context()
        for ends in (([0.0], [-1.0]), ([0.0], [1.0]), ([0.9], [0.0])):
            measures = [
                checker.measure_edge(*ends),
                checker.measure_edge_collision_free(*ends),
                checker.measure_edge_collision_free_parallel(*ends, threads=2),
                *checker.measure_edges_collision_free([ends], threads=2),
                checker.measure_context_edge_collision_free(context, *ends),
            ]
            found = {(each.status, each.alpha, each.distance, each.at) for each in measures}
            assert len(found) == 1
            assert context.q.tolist() == ends[1]
            (is_free,) = {
                checker.check_edge_collision_free(*ends),
                checker.check_edge_collision_free_parallel(*ends, threads=2),
                measures[0].proven,
            }
            assert is_free == (ends[1] == [-1.0])


def test_functions_of_ones_own(tmp_path):
    """Only for a checker made with one; None is the linear one again; its own are refused."""
    robots = diagram(tmp_path, SLIDE, BALL)
    plain = SceneGraphCollisionChecker(robots)
    assert plain.compute_configuration_distance([0.0], [-2.0]) == 2.0
    assert plain.interpolate_between_configurations([0.0], [-2.0], 0.25) == -0.5
    for change in (
        lambda: plain.set_configuration_distance_function(lambda q1, q2: 1.0),
        lambda: plain.set_configuration_interpolation_function(None),
    ):
        with pytest.raises(
            CollisionCheckerError, match="a LinearDistanceAndInterpolationProvider is in use"
        ):
            change()
    checker = SceneGraphCollisionChecker(
        robots, configuration_distance_function=lambda q1, q2: 3.0 * float(np.abs(q1 - q2).sum())
    )
    ask = checker.make_standalone_configuration_distance_function()
    between = checker.make_standalone_configuration_interpolation_function()
    assert ask([0.0], [-2.0]) == 6.0
    assert checker.measure_edge([0.0], [-2.0]).distance == 6.0
    checker.set_configuration_distance_function(lambda q1, q2: 5.0 * float(np.abs(q1 - q2).sum()))
    assert ask([0.0], [-2.0]) == 10.0
    same = checker.clone()
    checker.set_configuration_interpolation_function(lambda a, b, r: a + r * r * (b - a))
    assert between([0.0], [-2.0], 0.5) == -0.5
    assert same.interpolate_between_configurations([0.0], [-2.0], 0.5) == -1.0
    checker.set_configuration_interpolation_function(None)
    assert between([0.0], [-2.0], 0.5) == -1.0
    with pytest.raises(CollisionCheckerError, match="distance_function is this checker's own"):
        checker.set_configuration_distance_function(ask)
    with pytest.raises(CollisionCheckerError, match="interpolation_function is this checker's"):
        checker.set_configuration_interpolation_function(between)
    with pytest.raises(CollisionCheckerError, match="distance_function must be a function, not 3"):
        checker.set_configuration_distance_function(3)
    with pytest.raises(CollisionCheckerError, match="only one of distance_and_interpolation"):
        SceneGraphCollisionChecker(
            robots,
            distance_and_interpolation_provider=Detour(1.0),
            configuration_distance_function=lambda q1, q2: 1.0,
        )
    with pytest.raises(CollisionCheckerError, match="must be a DistanceAndInterpolationProvider"):
        plain.set_distance_and_interpolation_provider(None)


def test_steps_are_positive_and_not_endless(tmp_path):
    """The size is refused by its value, and a way of too many pieces by its length."""
    robots = diagram(tmp_path, SLIDE, BALL)
    for bad in (0.0, -1.0):
        with pytest.raises(CollisionCheckerError, match=f"edge_step_size must be positive.*{bad}"):
            SceneGraphCollisionChecker(robots, edge_step_size=bad)
    checker = SceneGraphCollisionChecker(
        robots, distance_and_interpolation_provider=Detour(0.1), edge_step_size=0.5
    )
    assert len(checker.way([0.0], [-1.9])) == 5
    checker.set_edge_step_size(1e-9)
    with pytest.raises(CollisionCheckerError, match=r"way of 1\.9 has more than 1000000 pieces"):
        checker.check_edge_collision_free([0.0], [-1.9])
    with pytest.raises(CollisionCheckerError, match="must be a finite number, not nan"):
        checker.set_edge_step_size(math.nan)


def test_a_function_that_throws_ends_its_own_call_only(tmp_path):
    """Beside it, and after it, others are answered."""

    def between(q1, q2, ratio):
        if q2[0] > 5.0:
            raise RuntimeError("no way there")
        return (1.0 - ratio) * q1 + ratio * q2

    checker = SceneGraphCollisionChecker(
        diagram(tmp_path, SLIDE, BALL),
        configuration_distance_function=lambda q1, q2: float(np.abs(q1 - q2).sum()),
    )
    checker.set_configuration_interpolation_function(between)

    def ask(k):
        q2 = 6.0 if k % 3 == 0 else -1.0
        try:
            return checker.check_edge_collision_free([0.0], [q2])
        except RuntimeError as error:
            return str(error)

    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(ask, range(30)))
    assert found == [True if k % 3 else "no way there" for k in range(30)]
    assert checker.check_config_collision_free([0.0])


def test_changes_from_two_threads_are_both_there(tmp_path, monkeypatch):
    """The second begins while the first is under way, and is not lost."""
    checker = SceneGraphCollisionChecker(
        diagram(tmp_path, SLIDE, BALL), configuration_distance_function=lambda q1, q2: 0.0
    )
    second = threading.Thread(
        target=checker.set_configuration_interpolation_function, args=(lambda a, b, r: 2.0 * a,)
    )
    change = FunctionsProvider.with_distance

    def slow_change(self, function):
        second.start()
        second.join(0.2)
        return change(self, function)

    monkeypatch.setattr(FunctionsProvider, "with_distance", slow_change)
    checker.set_configuration_distance_function(lambda q1, q2: 7.0)
    second.join()
    assert checker.compute_configuration_distance([1.0], [1.0]) == 7.0
    assert checker.interpolate_between_configurations([1.0], [1.0], 0.5) == 2.0
