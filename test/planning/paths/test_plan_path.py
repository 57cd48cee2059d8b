"""Paths that planners return, against the scene's own queries, and where the way is known."""

from concurrent.futures import ThreadPoolExecutor
import math
import signal
import threading
import time

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, move, PLATE, ROD, SLIDE

from scene_graph_ros.geometry.compiled.kernel import compilation_count
from scene_graph_ros.planning import (
    CollisionCheckerError,
    EdgeStatus,
    load_robot_diagram,
    plan_path,
    PlanFailure,
    PlanningError,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.paths.planners import PLANNERS
from scene_graph_ros.planning.paths.search import path_search
from scene_graph_ros.robots import KinematicTreeError

# A ball on two rails, x and y, before a wall 0.1 m thick at x = 1 with a gap at y = 0.4.
CART = """<robot name="cart"><link name="base"/><link name="beam"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="base"/><child link="beam"/>
  <axis xyz="1 0 0"/><limit lower="-1" upper="3"/></joint>
  <joint name="y" type="prismatic"><parent link="beam"/><child link="ball"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint></robot>"""

WALL = """
geometries:
  - name: left
    source: around
    pose: {{xyz: [1, {left}, 0]}}
    shape: {{type: box, size: [0.1, 2, 2]}}
  - name: right
    source: around
    pose: {{xyz: [1, {right}, 0]}}
    shape: {{type: box, size: [0.1, 2, 2]}}
"""

# Two balls on one rail: the second follows the first the other way.
PAIR = """<robot name="pair"><link name="base"/>
  <link name="one"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="two"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="lead" type="prismatic"><parent link="base"/><child link="one"/>
  <axis xyz="1 0 0"/><limit lower="-9" upper="9"/></joint>
  <joint name="echo" type="prismatic"><parent link="base"/><child link="two"/>
  <origin xyz="0 1 0"/><axis xyz="1 0 0"/><limit lower="-5" upper="5"/>
  <mimic joint="lead" multiplier="-2" offset="0.5"/></joint></robot>"""

ECHO_WALL = """
geometries:
  - {name: stop, source: around, pose: {xyz: [-1, 1, 0]}, shape: {type: sphere, radius: 0.1}}
"""

BESIDE_TABLE = ((0.3, -0.5, 0.5), (0.9, 0.5, 0.8))
IN_SHELF = ((-0.37, 0.66, 0.81), (0.27, 0.98, 1.2))
"""Corners (W, metres) of where a Panda's hand is."""


def wall(half_gap):
    """Return the wall with a gap that leaves the ball so much room on both sides."""
    away = 0.1 + half_gap + 1.0
    return WALL.format(left=0.4 + away, right=0.4 - away)


@pytest.fixture(scope="module")
def checker():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


@pytest.fixture(scope="module")
def problems(checker):
    """Free configurations with the hand over the table, and as many with it in the shelf."""
    tree, rng = checker.plan.tree, np.random.default_rng(0)
    found = [], []
    while min(map(len, found)) < 3:
        q = rng.uniform(tree.lower, tree.upper, (20000, tree.num_positions))
        p_WH = tree.link_poses(q, ["panda_hand"])[:, 0, :3, 3]
        for ends, (lower, upper) in zip(found, (BESIDE_TABLE, IN_SHELF), strict=True):
            near = q[((p_WH > lower) & (p_WH < upper)).all(axis=1)]
            ends.extend(near[checker.check_configs_collision_free(near)])
    return list(zip(found[0][:3], found[1][:3], strict=True))


def along(checker, path, count):
    """Return configurations along a path's edges, ``count`` of each."""
    tree, t = checker.plan.tree, np.linspace(0.0, 1.0, count)
    return np.array([tree.interpolate(a, b, s) for a, b in zip(path, path[1:]) for s in t])  # noqa: B905, RUF007


def penetrations(checker, q):
    """Return the pairs that the scene itself finds at q, of those that can move."""
    found = move(checker.model, q).compute_point_pair_penetration()
    pairs = {tuple(sorted((int(p.id_A), int(p.id_B)))) for p in found}
    return pairs & {tuple(sorted(map(int, checker.plan.ids(k)))) for k in range(checker.num_pairs)}


def test_a_panda_s_paths_are_free_by_the_scene_s_own_queries(checker, problems):
    """From over the table into the shelf: none of many samples of each path collides."""
    tree = checker.plan.tree
    for start, goal in problems:
        plan = plan_path(checker, start, goal, seed=3)
        assert plan.is_success and plan.proven and plan.failure is None and plan.reason is None
        path = plan.configurations
        np.testing.assert_array_equal(path[0], start)
        np.testing.assert_array_equal(path[-1], goal)
        assert ((path >= tree.lower) & (path <= tree.upper)).all()
        assert len(path) > 2  # no straight way leads there
        assert plan.length == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
        samples = along(checker, path, 200)
        assert checker.check_configs_collision_free(samples).all()
        assert not any(penetrations(checker, q) for q in samples[::97])
        near = [checker.calc_robot_clearance(q, 0.05).distances for q in samples[::11]]
        assert 0.0 < plan.least_clearance <= min(d.min(initial=np.inf) for d in near)
        measures = checker.measure_edges(np.stack([path[:-1], path[1:]], axis=1))
        assert all(measure.status is EdgeStatus.FREE for measure in measures)


def test_a_path_may_be_asked_about_again(checker, problems):
    """It can't be written to, and yet no kernel is compiled for it."""
    path = plan_path(checker, *problems[1]).configurations
    assert not path.flags.writeable
    before = compilation_count()
    assert checker.check_configs_collision_free(path).all()
    assert checker.check_edge_collision_free(path[0], path[1])
    edges = np.lib.stride_tricks.sliding_window_view(path, 2, axis=0).swapaxes(1, 2)
    assert all(measure.completely_free for measure in checker.measure_edges(edges))
    X_WH = checker.plan.tree.link_poses(path, ["panda_hand"])
    assert X_WH.shape == (len(path), 1, 4, 4)
    assert plan_path(checker, path[-1], path[0], seed=1).is_success
    assert compilation_count() == before


def test_the_seed_decides(checker, problems, monkeypatch):
    """The same path for the same seed: again, in threads, with a time limit and other memory."""
    start, goal = problems[0]
    path = plan_path(checker, start, goal, seed=5).configurations
    with ThreadPoolExecutor(2) as pool:
        again = list(pool.map(lambda _: plan_path(checker, start, goal, seed=5), range(2)))
    monkeypatch.setattr(path_search, "_ROOM", 2)
    again.append(plan_path(checker, start, goal, seed=5, timeout=1000))
    for plan in again:
        np.testing.assert_array_equal(plan.configurations, path)
    others = [plan_path(checker, start, goal, seed=seed) for seed in (6, 7)]
    assert all(not np.array_equal(plan.configurations, path) for plan in others)


@pytest.mark.parametrize("half_gap", [0.1, 0.01, 0.002])
def test_a_narrow_passage_is_found(tmp_path, half_gap):
    """A ball goes through a gap that leaves it so much room on both sides, and no more."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, CART, wall(half_gap)))
    plan = plan_path(checker, [0.0, -0.5], [2.0, -0.5], timeout=60)
    assert plan.is_success, plan.reason
    samples = along(checker, plan.configurations, 1000)
    assert checker.check_configs_collision_free(samples).all()
    # Where the ball's centre is within the wall it is within the gap.
    inside = np.abs(samples[:, 0] - 1.0) < 0.05
    assert inside.any()
    assert (np.abs(samples[inside, 1] - 0.4) <= half_gap).all()
    assert 0.0 < plan.least_clearance <= half_gap


def test_shortcuts_find_the_shortest_way(tmp_path):
    """To the other side of a wall that ends at y = 0.4: two straight edges that touch its end."""
    text = WALL.format(left=5.0, right=0.3 - 1.0)
    checker = SceneGraphCollisionChecker(diagram(tmp_path, CART, text))
    lengths = [plan_path(checker, [0, 0], [2, 0], seed=seed).length for seed in range(5)]
    # The centre goes round the wall's corners, (0.95, 0.3) and (1.05, 0.3), at 0.1 from each: a
    # tangent from (0, 0) to that circle, part of it, and 0.1 straight on in the middle.
    far, turn = math.hypot(0.95, 0.3), math.atan2(0.3, 0.95)
    angle = turn + math.asin(0.1 / far)
    shortest = 2.0 * (math.sqrt(far**2 - 0.1**2) + 0.1 * angle) + 0.1
    assert min(lengths) > shortest - 1e-9
    assert np.median(lengths) < 1.1 * shortest


def test_a_joint_without_an_end_goes_round_the_other_way(tmp_path):
    """A plate bars the short way from 0.2 to 0.9; the long one ends a full turn before 0.9."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    plan = plan_path(checker, [0.2], [0.9], timeout=60)
    assert plan.is_success, plan.reason
    path = plan.configurations[:, 0]
    assert path[0] == 0.2
    assert path[-1] == pytest.approx(0.9 - 2.0 * math.pi, abs=1e-12)
    assert plan.length == pytest.approx(2.0 * math.pi - 0.7, abs=1e-9)
    # Nothing is in the way across the half turn, where numbers of angles jump.
    short = plan_path(checker, [3.0], [-3.0])
    assert short.configurations[-1, 0] == pytest.approx(2.0 * math.pi - 3.0, abs=1e-12)
    assert short.length == pytest.approx(2.0 * math.pi - 6.0, abs=1e-12)
    several_turns = plan_path(checker, [0.2 + 6.0 * math.pi], [0.4])
    assert several_turns.configurations[-1, 0] == pytest.approx(0.4 + 6.0 * math.pi, abs=1e-12)


def test_what_follows_by_half_a_turn_does_not_go_round(tmp_path):
    """A full turn of a joint moves what follows it by half: then it is no way to the goal."""
    half = """<link name="slow"/><joint name="follower" type="continuous"><parent link="rod"/>
      <child link="slow"/><axis xyz="0 0 1"/><mimic joint="hinge" multiplier="{}"/></joint>
      </robot>"""
    for multiplier, arrives in (("0.5", False), ("-2", True)):
        urdf = ROD.replace("</robot>", half.format(multiplier))
        checker = SceneGraphCollisionChecker(diagram(tmp_path, urdf, PLATE))
        plan = plan_path(checker, [0.2], [0.9], timeout=60 if arrives else 0.2)
        assert plan.is_success == arrives, plan.reason


def test_what_is_walled_in_is_told_so_in_time(tmp_path):
    """A ball on a rail can't pass another one: trees reach q = 0.7 and 1.3, and no farther."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_path(checker, [0.0], [2.0], timeout=0.3)
    assert not plan.is_success and not plan.proven
    assert plan.failure is PlanFailure.TIMEOUT
    assert plan.configurations.shape == (0, 1) and plan.least_clearance == 0.0
    first, second = plan.tree_sizes
    assert first > 1 and second > 1 and plan.edges > 2
    beginning = "no path was found within 0.3 s: the trees from start and goal have"
    assert plan.reason.startswith(f"{beginning} {first} and {second} configurations, ")
    apart = float(plan.reason.split(" configurations, ")[1].split(" ")[0])
    assert 0.6 <= apart <= 2.0
    at_once = plan_path(checker, [0.0], [2.0], timeout=0)
    assert at_once.failure is PlanFailure.TIMEOUT


def test_a_tree_that_is_full_ends_the_search(tmp_path, monkeypatch):
    """With no limit of time, memory is one."""
    monkeypatch.setattr(path_search, "_MOST_NODES", 512)
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_path(checker, [0.0], [2.0])
    assert plan.failure is PlanFailure.EXHAUSTED
    assert max(plan.tree_sizes) == 512
    assert plan.reason.startswith("no path was found: the trees")


def test_a_timeout_is_kept(tmp_path):
    """To a tenth of a second; of some tries at least one, as the machine may be busy."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan_path(checker, [0.0], [2.0], timeout=0.01)
    late = []
    while not late or (min(late) >= 0.1 and len(late) < 40):
        begin = time.monotonic()
        plan = plan_path(checker, [0.0], [2.0], timeout=0.2)
        late.append(time.monotonic() - begin - 0.2)
        assert plan.failure is PlanFailure.TIMEOUT
        assert late[-1] >= 0.0
    assert min(late) < 0.1


def test_a_path_that_is_found_is_returned_when_time_is_over(checker, problems, monkeypatch):
    """As long as it is by then, and proven: here time ends before the first shortcut."""
    start, goal = problems[0]
    shortened = path_search.PathSearch.shortened

    def too_late(search, path):
        search._task.stop[0] = 1
        return shortened(search, path)

    short = plan_path(checker, start, goal, seed=3)
    monkeypatch.setattr(path_search.PathSearch, "shortened", too_late)
    plan = plan_path(checker, start, goal, seed=3)
    assert plan.is_success and plan.proven
    assert plan.length > 1.01 * short.length
    np.testing.assert_array_equal(plan.configurations[[0, -1]], [start, goal])
    assert checker.check_configs_collision_free(along(checker, plan.configurations, 200)).all()


@pytest.fixture
def interrupts():
    """Ctrl-C raises, also where who started the tests ignores it, as shells do behind &."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_an_interrupt_ends_a_search_without_an_end(tmp_path):
    """As Ctrl-C does; nothing goes on computing afterwards."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    main = threading.main_thread().ident
    before = threading.active_count()
    timer = threading.Timer(0.2, signal.pthread_kill, (main, signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        plan_path(checker, [0.0], [2.0])
    timer.join()
    assert threading.active_count() == before


def test_a_start_that_is_the_goal_is_a_path(tmp_path):
    """Of one configuration, proven like others; also up to full turns, or among other goals."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_path(checker, [0.5], [0.5])
    assert plan.is_success and plan.length == 0.0 and plan.goal == 0
    np.testing.assert_array_equal(plan.configurations, [[0.5]])
    # The balls are 0.2 apart.
    assert 0.0 < plan.least_clearance <= 0.2
    assert plan_path(checker, [0.5], [[2.0], [0.5]], timeout=5).goal == 1


def test_of_several_goals_any_will_do(tmp_path):
    """Those that collide, are beyond limits or walled in are passed over."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    goals = [[1.1], [10.0], [2.0], [-3.0]]
    plan = plan_path(checker, [0.0], goals, timeout=60)
    assert plan.goal == 3
    np.testing.assert_array_equal(plan.configurations, [[0.0], [-3.0]])
    none = plan_path(checker, [0.0], goals[:2])
    assert none.failure is PlanFailure.GOAL_BEYOND_LIMITS
    assert none.reason.startswith("none of 2 goals can be reached: goal 0 collides: ")
    assert "goal 1 is beyond the limits [-9, 9] of 'rail': 10" in none.reason


def test_starts_and_goals_that_collide_say_what_with(tmp_path):
    """With the names of scene files, and how deep: at q the balls overlap by 0.3 - |1 - q|."""
    robot = diagram(tmp_path, SLIDE, BALL)
    checker = SceneGraphCollisionChecker(robot)
    names = "robot/ball/ball_collision_0 and around/world/ball"
    plan = plan_path(checker, [0.9], [0.0])
    assert plan.failure is PlanFailure.START_COLLIDES
    assert plan.reason == f"the start collides: {names} overlap by 200 mm"
    plan = plan_path(checker, [0.0], [0.725])
    assert plan.failure is PlanFailure.GOAL_COLLIDES
    assert plan.reason == f"the goal collides: {names} overlap by 25 mm"
    padded = SceneGraphCollisionChecker(robot, env_collision_padding=0.05)
    plan = plan_path(padded, [0.69], [0.0])
    assert plan.reason == (
        f"the start collides: {names} are 40 mm nearer than their padding of 50 mm;"
        " set_padding gives such a pair one of its own"
    )
    near = plan_path(checker, [0.7 - 1e-6], [0.0])
    assert near.failure is PlanFailure.START_COLLIDES
    assert near.reason == f"the start is too near to a collision: {names} keep less than 0.02 mm"
    plan = plan_path(checker, [-9.5], [0.0])
    assert plan.failure is PlanFailure.START_BEYOND_LIMITS
    assert plan.reason == "the start is beyond the limits [-9, 9] of 'rail': -9.5"


def test_joints_that_follow_are_planned_for(tmp_path):
    """The second ball is at 0.5 - 2 q: in the way of a wall at q = 0.75 - 0.1, and at 2.75."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, PAIR, ECHO_WALL))
    plan = plan_path(checker, [-1.0], [0.64])
    np.testing.assert_array_equal(plan.configurations, [[-1.0], [0.64]])
    assert plan.least_clearance <= 0.02
    blocked = plan_path(checker, [-1.0], [0.66])
    assert blocked.failure is PlanFailure.GOAL_COLLIDES
    assert "robot/two/two_collision_0" in blocked.reason
    # Its limits are the leader's: 0.5 - 2 q within 5 of zero.
    beyond = plan_path(checker, [-1.0], [2.8])
    assert beyond.reason == "the goal is beyond the limits [-2.25, 2.75] of 'lead': 2.8"


def test_a_drone_flies_round_a_wall(tmp_path):
    """Quaternions have any length and sign; its place has no limits."""
    wall_ahead = """
geometries:
  - {name: wall, source: around, pose: {xyz: [1, 0, 0]}, shape: {type: box, size: [0.1, 2, 2]}}
"""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, wall_ahead))
    start, goal = [2.0, 0, 0, 0, 0, 0, 0], [0.0, 0, 0, -3.0, 2.0, 0, 0]
    plan = plan_path(checker, start, goal, timeout=120)
    assert plan.is_success, plan.reason
    path = plan.configurations
    np.testing.assert_allclose(path[0], [1, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(path[-1], [0, 0, 0, -1, 2, 0, 0])
    np.testing.assert_allclose(np.linalg.norm(path[:, :4], axis=1), 1.0, atol=1e-12)
    assert checker.check_configs_collision_free(along(checker, path, 300)).all()
    # Round the wall's nearest edge it is 1 m aside, and half a turn.
    assert plan.length > math.hypot(2.0 * math.sqrt(2.0), math.pi) - 0.1


def test_what_is_not_of_the_group_stays(checker, problems):
    """Fingers stay where they are while the arm moves; goals that would move them are refused."""
    start, goal = (np.append(q[:7], 0.01) for q in problems[0])
    plan = plan_path(checker, start, goal, group="arm", timeout=120)
    assert plan.is_success, plan.reason
    assert (plan.configurations[:, 7] == 0.01).all()
    goal[7] = 0.02
    with pytest.raises(PlanningError, match="'panda_finger_joint1' is not of group 'arm'"):
        plan_path(checker, start, goal, group="arm")


@pytest.mark.parametrize("planner", PLANNERS)
def test_every_planner_is_explained(planner):
    """Where it is asked for by name."""
    assert f'"{planner}"' in plan_path.__doc__


def test_bad_arguments_are_named(tmp_path):
    """With the field and the value."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    with pytest.raises(PlanningError, match="rrt_connect, prm, or an OmplPlanner, not 'best'"):
        plan_path(checker, [0.0], [0.5], planner="best")
    for seed in (-1, 0.5, None, "a", math.inf):
        with pytest.raises(PlanningError, match=f"seed must be a whole number .* not {seed!r}"):
            plan_path(checker, [0.0], [0.5], seed=seed)
    for timeout in (-1.0, math.nan, math.inf, "a"):
        with pytest.raises(PlanningError, match=f"timeout must be seconds .* not {timeout!r}"):
            plan_path(checker, [0.0], [0.5], timeout=timeout)
    with pytest.raises(PlanningError, match=r"start must have shape \(nq,\), not \(1, 1\)"):
        plan_path(checker, [[0.0]], [0.5])
    with pytest.raises(PlanningError, match="goal must have at least one configuration"):
        plan_path(checker, [0.0], np.empty((0, 1)))
    with pytest.raises(KinematicTreeError, match="'rail' of configuration 1 must be finite"):
        plan_path(checker, [0.0], [[0.5], [math.nan]])
    with pytest.raises(CollisionCheckerError, match=r"'rail' of configuration 0 is beyond 1e\+"):
        plan_path(checker, [1e300], [0.5])
    with pytest.raises(KinematicTreeError, match="has no group 'none'"):
        plan_path(checker, [0.0], [0.5], group="none")
