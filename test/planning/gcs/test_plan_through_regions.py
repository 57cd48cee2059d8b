"""From regions to a robot's trajectory in one call: its time, its proof, and what stops it."""

import itertools
import math

import numpy as np
import pytest
from robot_scenes import BALL, diagram, PLATE, ROD, SLIDE

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperrectangle,
    save_iris_regions_yaml_file,
)
from scene_graph_ros.planning import (
    EdgeStatus,
    get_continuous_revolute_joint_indices,
    load_robot_diagram,
    OutOfTimeError,
    plan_through_regions,
    RegionNotFoundError,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.gcs.termination import in_time
from scene_graph_ros.planning.parallel import deadline

SEARCH = GraphOfConvexSetsOptions(convex_relaxation=False)


def test_a_ball_on_a_rail_goes_as_fast_as_it_may_up_to_the_post(tmp_path):
    """1.6 m at 0.5 m/s; it touches where the rail is at 0.7. Regions from a file."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    path = tmp_path / "regions.yaml"
    boxes = [([-2.0], [0.0]), ([-0.5], [0.9])]
    regions = [HPolyhedron.make_box(*box) for box in boxes]
    save_iris_regions_yaml_file(path, {"far": regions[0], "near": regions[1]})
    plan = plan_through_regions(path, [-1.0], [0.6], velocities=[0.5], checker=checker)
    assert plan.is_success
    assert plan.result.cost == pytest.approx(3.2, abs=1e-6)
    assert plan.result.lower_bound <= 3.2
    assert len(plan.measures) == plan.trajectory.num_segments == 2
    # Half of the least distance is kept at least, as proofs of edges promise.
    assert 0.05 - 1e-9 <= plan.least_clearance <= 0.1
    # The regions promise more than there is: what the checker says counts.
    hit = plan_through_regions(regions, [-1.0], [0.8], velocities=[0.5], checker=checker)
    assert not hit.is_success
    assert hit.trajectory is not None
    assert hit.measures[1].status is EdgeStatus.COLLIDES
    assert hit.least_clearance == 0.0
    assert hit.reason.startswith("segment 1 collides at 0.")
    assert hit.reason.endswith("robot/ball/ball_collision_0 and around/world/ball")
    # Without a checker the regions are all that is known.
    assert plan_through_regions(regions, [-1.0], [0.8], velocities=[0.5]).is_success


def test_regions_grow_along_a_path_where_none_are_given(tmp_path):
    """1.6 m at 0.5 m/s on a rail up to the post; beyond it there is no path to grow along."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_through_regions(None, [-1.0], [0.6], velocities=[0.5], checker=checker)
    assert plan.is_success
    assert plan.result.cost == pytest.approx(3.2, abs=1e-6)
    assert len(plan.grown) >= 1
    ends = np.array([[-1.0], [0.6]])
    assert [any(r.point_in_set(q) for r in plan.grown) for q in ends] == [True, True]
    # What is grown keeps more than what has to be kept: it touches at 0.7.
    assert max(r.support([1.0]).value for r in plan.grown) <= 0.69 + 1e-9
    with pytest.raises(RegionNotFoundError, match=r"no path to grow regions along: .*"):
        plan_through_regions(None, [-1.0], [0.695], velocities=[0.5], checker=checker)
    with pytest.raises(ConvexSetError, match="without a checker none can grow"):
        plan_through_regions(None, [-1.0], [0.6], velocities=[0.5])
    with pytest.raises(ConvexSetError, match=r"growth_padding must be .*-1"):
        plan_through_regions(
            None, [-1.0], [0.6], velocities=[0.5], checker=checker, growth_padding=-1.0
        )


def test_time_that_is_over_and_who_watches(tmp_path, monkeypatch):
    """No time for a path, for regions, for a trajectory; an exception comes out of each."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    boxes = [HPolyhedron.make_box(*box) for box in (([-2.0], [0.0]), ([-0.5], [0.9]))]
    how = {"velocities": [0.5], "checker": checker}
    with pytest.raises(OutOfTimeError, match=r"no path .* within 0 s"):
        plan_through_regions(None, [-1.0], [0.6], timeout=0.0, **how)
    asked = []
    own = GraphOfConvexSetsOptions(termination_func=lambda: bool(asked.append(1)))
    assert in_time(own, 0.0, None).termination_func()
    assert not in_time(own, 600.0, None).termination_func()
    assert asked == [1]
    assert in_time(own, None, None) is own
    with pytest.raises(ConvexSetError, match=r"timeout must be seconds from 0 on, .* not -1"):
        plan_through_regions(boxes, [-1.0], [0.6], timeout=-1.0, **how)

    # By a clock on which each look is a turn.
    ticks = itertools.count()
    monkeypatch.setattr(deadline, "monotonic", lambda: 0.06 * next(ticks))
    calls = []
    plan = plan_through_regions(
        None, [-1.0], [0.6], timeout=600.0, watch=lambda: calls.append(1), **how
    )
    assert plan.is_success and plan.result.cost == pytest.approx(3.2, abs=1e-6)
    count = len(calls)
    assert count >= 3

    class EnoughError(Exception):
        pass

    for last in (1, count // 2):  # while a path is looked for, while regions grow
        left = iter(range(last))

        def watch(left=left):
            if next(left, None) is None:
                raise EnoughError

        with pytest.raises(EnoughError):
            plan_through_regions(None, [-1.0], [0.6], watch=watch, **how)


def test_a_rod_turns_the_way_round_that_is_free(tmp_path):
    """The hinge turns without an end; a plate is in its way at 0.5, so it goes by pi."""
    robot = diagram(tmp_path, ROD, PLATE)
    checker = SceneGraphCollisionChecker(robot)
    assert get_continuous_revolute_joint_indices(robot.tree) == [0]
    lows = np.array([0.6, 2.6, 4.6])
    regions = [Hyperrectangle([low], [low + 2.1]) for low in lows]
    start, goal = [0.7], [0.3]
    plan = plan_through_regions(
        regions, start, goal, velocities=[1.0], checker=checker, options=SEARCH
    )
    assert plan.is_success
    assert plan.result.cost == pytest.approx(2.0 * math.pi - 0.4, abs=1e-6)
    ends = plan.trajectory.value([0.0, plan.trajectory.end_time])
    np.testing.assert_allclose(ends, [[0.7], [0.3 + 2.0 * math.pi]], atol=1e-12)
    assert plan.trajectory.is_continuous(0, 1e-12)


def test_a_panda_moves_through_overlapping_boxes_proven():
    """Three boxes of configurations above the table; all segments are proven free."""
    robot = load_robot_diagram("config/scenes/panda_cell.yaml")
    checker = SceneGraphCollisionChecker(robot)
    tree = robot.tree
    rng = np.random.default_rng(3)
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    found = rng.uniform(lower, upper, (400, tree.num_positions))
    q = found[checker.check_configs_collision_free(found)][0]
    half = 0.05
    way = np.zeros(tree.num_positions)
    way[:7] = [0.06, -0.04, 0.05, -0.06, 0.03, 0.04, 0.05]
    regions = [Hyperrectangle(q + k * way - half, q + k * way + half) for k in range(3)]
    regions = [
        Hyperrectangle(
            np.clip(r.lb, tree.lower, tree.upper), np.clip(r.ub, tree.lower, tree.upper)
        )
        for r in regions
    ]
    plan = plan_through_regions(
        regions,
        q,
        q + 2.0 * way,
        velocities=np.full(tree.num_positions, 0.4),
        order=4,
        continuity_order=2,
        checker=checker,
        options=SEARCH,
    )
    assert plan.is_success, plan.reason
    # Nothing is in the way of the straight line, along which the fastest joint decides.
    assert plan.result.cost == pytest.approx(0.12 / 0.4, abs=1e-5)
    assert plan.least_clearance > 0.0
    path = plan.trajectory
    for t in np.linspace(0.0, path.end_time, 50):
        assert checker.check_config_collision_free(path.value(t))


def test_which_end_is_in_no_region_is_said(tmp_path):
    """With the nearest region and how far it is; what makes no sense is named."""
    regions = [Hyperrectangle([0.0, 0.0], [1.0, 1.0]), Hyperrectangle([1.0, 0.0], [2.0, 1.0])]
    plan = plan_through_regions(regions, [0.5, 0.5], [2.25, 0.5], velocities=[1.0, 1.0])
    assert not plan.is_success
    assert plan.trajectory is None
    assert plan.reason == (
        "the goal is in none of 2 regions; regions[1] is the nearest, 0.25 away"
    )
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE))
    for arguments, words in [
        ({"start": [np.nan, 0.0]}, "start must hold finite numbers"),
        ({"goal": [1.0]}, r"goal must have the shape \(2,\), not \(1,\)"),
        ({"velocities": [1.0, 0.0]}, r"velocities\[1\] must be positive, not 0.0"),
        ({"order": 0}, "order must be a whole number, at least 1, not 0"),
        ({"continuity_order": -1}, "continuity_order must be a whole number, at least 0"),
        ({"continuity_order": 4}, "must not be above the order of both, 3, not 4"),
        ({"checker": checker}, "start has 2 positions, the checker's robots have 1"),
        ({"time_weight": -1.0}, "weight must be a finite number, at least 0, not -1.0"),
    ]:
        given = {"start": [0.5, 0.5], "goal": [1.5, 0.5], "velocities": [1.0, 1.0], **arguments}
        with pytest.raises(ConvexSetError, match=words):
            plan_through_regions(regions, **given)
