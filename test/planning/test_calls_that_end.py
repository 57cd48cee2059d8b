"""Calls that plan, time or prove: each has a time limit, and a function that may end it."""

import inspect
import itertools
import pickle

import numpy as np
import pytest
from robot_scenes import CART, diagram, POST

from scene_graph_ros import planning
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid, Point
from scene_graph_ros.planning.parallel import deadline as deadlines
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.trajectories import MotionLimits, PiecewisePolynomial

START, GOAL = np.array([0.0, 0.5]), np.array([2.0, 0.9])
LIMITS = MotionLimits([1.0, 1.0], [2.0, 2.0], ("x", "y"), [20.0, 20.0])
CERTIFY = "it certifies what is given; options limit the work"

OTHERS = {
    "add_direct_collocation_constraint": "it adds to a program that another call solves",
    "certify_by_distances": CERTIFY,
    "compute_collision_avoidance_displacement": "one question about one configuration",
    "get_continuous_revolute_joint_indices": "it reads a tree",
    "load_robot_diagram": "it reads a file",
    "make_body_shape_description": "it reads a scene",
    "measure_constraints": "one question about each configuration",
    "CspaceFreeBox.find_pair_certificate": CERTIFY,
    "CspaceFreeBox.find_separation_certificate_given_box": CERTIFY,
    "CspaceFreePolytope.binary_search": CERTIFY,
    "CspaceFreePolytope.find_pair_certificate": CERTIFY,
    "CspaceFreePolytope.find_separation_certificate_given_polytope": CERTIFY,
    "CspaceFreePolytope.search_with_bilinear_alternation": CERTIFY,
    "CspaceFreePolytope.solve_separation_certificate_program": CERTIFY,
    "MaxCliqueSolverBase.solve_max_clique": "a graph's question; solvers have limits",
    "MaxCliqueSolverViaBranchAndBound.solve_max_clique": "its time_limit ends it",
    "MaxCliqueSolverViaGreedy.solve_max_clique": "it takes each vertex once",
    "MaxCliqueSolverViaMip.solve_max_clique": "its solver_options have a time limit",
    "MinCliqueCoverSolverBase.solve_min_clique_cover": "a graph's question; solvers have limits",
    "MinCliqueCoverSolverViaGreedy.solve_min_clique_cover": "the clique solver's limits end it",
    "Roadmap.grow": "it adds configurations that are given",
    "SceneGraphCollisionChecker.find_colliding_pair": "one question about one configuration",
    "SceneGraphCollisionChecker.find_collisions": "one question about each configuration",
    "ZmpPlanner.plan": "it is a closed form",
}
"""Functions and methods of a planner's verbs without a time limit, and why."""

VERBS = (
    *("binary", "build", "certify", "find", "grow", "inverse", "iris", "plan", "prove", "region"),
    *("search", "solve", "thin", "time_", "visibility"),
)


def public_calls():
    """Yield each public function, and each public method whose name begins with a verb."""
    for name in planning.__all__:
        each = getattr(planning, name)
        if inspect.isfunction(each):
            yield name, each
        elif inspect.isclass(each) and not issubclass(each, Exception):
            for method, body in inspect.getmembers(each, inspect.isfunction):
                is_other = method in ("build", "certify_by_distances", "time_step")
                if method.startswith(VERBS) and not is_other:
                    yield f"{name}.{method}", body


@pytest.fixture(scope="module")
def checker(tmp_path_factory):
    """A ball on two rails, with a post far away."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=9.0, y=9.0))
    return planning.SceneGraphCollisionChecker(robots)


def graph(checker):
    """Return a problem of trajectories through a box, its start and its goal."""
    found = planning.GcsTrajectoryOptimization(2)
    free = found.add_regions([HPolyhedron.make_box([-1.0, -1.0], [3.0, 1.0])], 3, name="free")
    begin, end = (found.add_regions([Point(q)], 0) for q in (START, GOAL))
    found.add_edges(begin, free)
    found.add_edges(free, end)
    found.add_time_cost()
    found.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    return found, begin, end


def curve(checker):
    """Return the problem of a curve from the start to the goal."""
    found = planning.KinematicTrajectoryOptimization(2, 6)
    found.add_path_position_constraint(START, START, 0.0)
    found.add_path_position_constraint(GOAL, GOAL, 1.0)
    found.add_duration_cost(1.0)
    found.add_path_length_cost(0.1)
    found.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    found.add_clearance_constraint(checker, 0.01)
    return found


def program(checker):
    """Return a nonlinear program of two variables."""
    found = planning.NonlinearProgram()
    x = found.new_variables(2, "x")
    found.add_cost((x[0] - 1.0) ** 4 + (x[1] * x[0] - 2.0) ** 2)
    return found


def pendulum(kind):
    """Return a swing of a pendulum by collocation or transcription."""
    system = planning.Dynamics(lambda x, u, t, p: [x[1], u[0] - x[0]], 2, 1)
    steps = (0.1, 0.5) if kind is planning.DirectCollocation else (0.1,)
    found = kind(system, 8, *steps)
    found.prog().add_constraint(found.final_state()[0] == 1.0)
    found.add_running_cost(found.input()[0] ** 2)
    return found


@pytest.fixture(scope="module")
def calls(checker):
    """A call of each, with a time limit and a function that watches."""
    tree = checker.plan.tree
    link = tree.link_names[-1]
    X_WT = tree.link_poses(GOAL, [link])[0]
    domain = HPolyhedron.make_box([-1.0, -1.0], [3.0, 1.0])
    line = PiecewisePolynomial.first_order_hold([0.0, 1.0], [START, GOAL])
    timed = planning.time_path(checker, [START, GOAL], LIMITS)
    ball = Hyperellipsoid.make_hypersphere(0.01, START)
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (80, 2))
    target = planning.PoseTarget(link, X_WT)
    corner = [START, np.array([2.0, 0.5]), GOAL]
    rounded = planning.time_path(checker, corner, LIMITS)
    assert len(rounded.points.positions) > 60
    problem, begin, end = graph(checker)
    way = [begin.vertices[0], problem.get_subgraphs()[0].vertices[0], end.vertices[0]]
    return {
        "plan_path": lambda **how: planning.plan_path(checker, START, GOAL, **how),
        "plan_straight": lambda **how: planning.plan_straight(
            checker, START, X_WT[np.newaxis], link, **how
        ),
        "plan_through_regions": lambda **how: planning.plan_through_regions(
            [domain], START, GOAL, velocities=[1.0, 1.0], checker=checker, **how
        ),
        "plan_trajectory": lambda **how: planning.plan_trajectory(
            checker, START, GOAL, LIMITS, **how
        ),
        "prove_trajectory": lambda **how: planning.prove_trajectory(
            checker, timed.points, LIMITS, **how
        ),
        "thin_trajectory": lambda **how: planning.thin_trajectory(
            checker, rounded, LIMITS, 60, deviation=0.1, **how
        ),
        "time_curve": lambda **how: planning.time_curve(checker, line, LIMITS, at=START, **how),
        "time_path": lambda **how: planning.time_path(checker, [START, GOAL], LIMITS, **how),
        "build_roadmap": lambda **how: planning.build_roadmap(checker, START, 50, **how),
        "inverse_kinematics": lambda **how: planning.inverse_kinematics(checker, target, **how),
        "inverse_kinematics_of_poses": lambda **how: planning.inverse_kinematics_of_poses(
            checker, link, X_WT[np.newaxis], **how
        ),
        "iris_in_configuration_space": lambda **how: planning.iris_in_configuration_space(
            checker, START, domain=domain, certificate=True, **how
        ),
        "iris_in_configuration_space_from_clique_cover": lambda **how: (
            planning.iris_in_configuration_space_from_clique_cover(
                checker, domain=domain, certificate=True, **how
            )
        ),
        "iris_zo": lambda **how: planning.iris_zo(checker, ball, domain, certificate=True, **how),
        "region_around": lambda **how: planning.region_around(checker, START, domain, **how),
        "regions_along": lambda **how: planning.regions_along(checker, corner, domain, **how),
        "regions_around": lambda **how: planning.regions_around(
            checker, [START, GOAL], domain, **how
        ),
        "visibility_graph": lambda **how: planning.visibility_graph(checker, points, **how),
        "GcsTrajectoryOptimization.solve_convex_restriction": lambda **how: (
            problem.solve_convex_restriction(way, **how)
        ),
        "GcsTrajectoryOptimization.solve_path": lambda **how: problem.solve_path(
            begin, end, **how
        ),
        "KinematicTrajectoryOptimization.solve": lambda **how: curve(checker).solve(**how),
        "NonlinearProgram.solve": lambda **how: program(checker).solve(**how),
        "DirectCollocation.solve": lambda **how: pendulum(planning.DirectCollocation).solve(**how),
        "DirectTranscription.solve": lambda **how: pendulum(planning.DirectTranscription).solve(
            **how
        ),
    }


def test_all_that_plan_have_both(calls):
    """Each public function, and each method with a planner's verb; others have a reason."""
    found = dict(public_calls())
    timed = {
        name for name, each in found.items()
        if {"timeout", "watch"} <= set(inspect.signature(each).parameters)
    }  # fmt: skip
    assert set(found) - timed == set(OTHERS)
    inherited = {"MultipleShooting.solve"}
    assert set(calls) == timed - inherited


NAMES = sorted(
    name for name, _ in public_calls() if name not in OTHERS and name != "MultipleShooting.solve"
)


@pytest.mark.parametrize("name", NAMES)
def test_a_function_that_watches_may_end_it(calls, name):
    """Its exception comes out; and it may let all go on."""

    class EnoughError(Exception):
        pass

    seen = []

    def enough(*_):
        raise EnoughError

    call = calls[name]
    with pytest.raises(EnoughError):
        call(timeout=60.0, watch=enough)
    assert call(timeout=60.0, watch=lambda *progress: seen.append(progress)) is not None
    assert seen


class Clock:
    """Each time it is read, a second has passed."""

    def __init__(self):
        self.reads = 0

    def __call__(self):
        self.reads += 1
        return float(self.reads)


def end_of(call, timeout):
    """Return how a call ended: ``late``, ``done`` or ``none``."""
    try:
        answer = call(timeout=timeout)
    except planning.OutOfTimeError:
        return "late"
    answer = answer[-1] if isinstance(answer, (tuple, list)) else answer
    failure = getattr(answer, "failure", None)
    if failure is not None:
        plan = getattr(answer, "plan", None)
        kinds = {failure.name, getattr(getattr(plan, "failure", None), "name", None)}
        assert "TIMEOUT" in kinds, answer.reason
        return "late"
    status = getattr(getattr(answer, "program_result", answer), "status", None)
    is_late = status is planning.SolveStatus.TIME_LIMIT
    is_late |= getattr(getattr(answer, "result", answer), "is_stopped", False)
    is_late |= getattr(answer, "reason", None) == "timeout"
    is_late |= not getattr(answer, "is_tried", np.ones(1, dtype=bool)).all()
    return "late" if is_late else "done"


@pytest.mark.parametrize("name", NAMES)
def test_time_that_is_over_ends_it(calls, name, monkeypatch):
    """By a clock that goes on when it is read: a call that is late reads it a few times more."""
    call = calls[name]
    assert end_of(call, 600.0) == "done"
    clock = Clock()
    monkeypatch.setattr(deadlines, "monotonic", clock)
    ends = []
    for timeout in (0.0, 3.0, 10.0, 30.0, 1e6):
        begin = clock.reads
        ends.append(end_of(call, timeout))
        if ends[-1] == "late":
            assert clock.reads - begin <= timeout + 24, timeout
    assert ends[0] == "late"
    assert ends[-1] == "done"
    assert ends == sorted(ends, key=("late", "done").index)


@pytest.mark.parametrize("name", NAMES)
def test_a_function_that_watches_may_end_it_on_the_way(calls, name, monkeypatch):
    """At its second call, in the middle and at its last one: it is not called once more.

    By a clock that goes on when it is read it is called at each look.
    """

    class EnoughError(Exception):
        pass

    call, clock = calls[name], Clock()
    monkeypatch.setattr(deadlines, "monotonic", clock)
    seen = []
    call(timeout=1e6, watch=lambda *_: seen.append(clock.reads))
    count, ended = len(seen), 0
    for most in sorted({2, max(count // 2, 1), count}):
        seen.clear()

        def enough(*_, most=most):
            seen.append(clock.reads)
            if len(seen) >= most:
                raise EnoughError

        try:
            call(timeout=1e6, watch=enough)
        except EnoughError:
            ended += 1
            assert len(seen) == most
            assert clock.reads - seen[-1] <= 24
        else:  # Threads that wait look more or less often.
            assert len(seen) < most
    assert ended > 0


@pytest.mark.parametrize("name", NAMES)
def test_times_that_mean_nothing(calls, name):
    """The message has the value."""
    for timeout in (-1.0, np.nan, np.inf, "1", [1.0]):
        with pytest.raises(SceneGraphError, match="timeout must be seconds from 0 on, or None"):
            calls[name](timeout=timeout)


def test_a_deadline_of_another_process(monkeypatch):
    """It has what is left, and calls nobody."""
    clock, seen = Clock(), []
    monkeypatch.setattr(deadlines, "monotonic", clock)
    here = Deadline(100.0, lambda: seen.append(clock.reads))
    assert len(seen) == 1
    left = here.left
    for there in (here.apart(), pickle.loads(pickle.dumps(here))):
        assert left - 10.0 < there.timeout < left
        assert there.is_set and not there.is_over()
    assert len(seen) == 1
    assert not Deadline().is_set
    assert not any(Deadline().is_over() for _ in itertools.repeat(None, 1000))
