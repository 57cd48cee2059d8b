"""Proofs that edges hold constraints, against samples of other kinematics."""

import math

import numpy as np
from plain_kinematics import bezier, PlainRobot, random_robot, slerped
import pytest
from robot_scenes import diagram

from scene_graph_ros.planning import (
    AngleBetweenVectorsConstraint,
    ConstraintStatus,
    measure_constraints,
    OrientationConstraint,
    PlanningError,
    PositionConstraint,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots import KinematicTreeError

SLACK = 2e-9
SAMPLES = 80


def angle_between(a, b):
    """Return the angle between two vectors, also where it is small."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return 2.0 * math.atan2(np.linalg.norm(a - b), np.linalg.norm(a + b))


def angle_of(R):
    """Return the angle of a rotation, also where it is small or near pi."""
    sine = 0.5 * np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return math.atan2(sine, 0.5 * (np.trace(R) - 1.0))


def excess(robot, each, q):
    """Return how far beyond its bounds a constraint is; negative: held with so much room."""
    X = robot.relative(q, each.frame, each.link)
    R = X[:3, :3]
    if isinstance(each, AngleBetweenVectorsConstraint):
        angle = angle_between(each.a_A, R @ each.b_L)
        upper = -math.inf if each.angle_upper >= math.pi else angle - each.angle_upper
        return max(upper, each.angle_lower - angle if each.angle_lower > 0.0 else -math.inf)
    if isinstance(each, OrientationConstraint):
        return angle_of(R @ each.R_LT @ each.R_AT.T) - each.theta_bound
    p = np.linalg.inv(each.X_AF) @ X @ np.append(each.p_LQ, 1.0)
    return max((p[:3] - each.p_FQ_upper).max(), (each.p_FQ_lower - p[:3]).max())


def rotation(rng):
    """Return a random rotation."""
    Q, R = np.linalg.qr(rng.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))


def random_constraint(rng, robot, q):
    """Return a random constraint, of which a configuration is inside or a little outside."""
    link, frame = rng.choice(robot.links[1:], 2, replace=False)
    frame = None if rng.random() < 0.5 else str(frame)
    link, kind = str(link), rng.integers(3)
    room = float(10.0 ** rng.uniform(-2.5, 0.0))
    X = robot.relative(q, frame, link)
    if kind == 0:
        a, b = rng.standard_normal((2, 3))
        angle = angle_between(a, X[:3, :3] @ b)
        lower = max(0.0, angle - room) if rng.random() < 0.5 else 0.0
        upper = min(math.pi, angle + room * rng.uniform(0.0, 1.0)) if lower else math.pi
        if rng.random() < 0.3 or upper - lower < 1e-3:
            lower, upper = 0.0, min(math.pi, angle + room)
        return AngleBetweenVectorsConstraint(link, a, b, upper, lower, frame)
    if kind == 1:
        R_LT, R = rotation(rng), rotation(rng)
        R_AT = X[:3, :3] @ R_LT
        if rng.random() < 0.3:
            return OrientationConstraint(link, R, 0.9 * math.pi, R_LT, frame)
        return OrientationConstraint(link, R_AT, room, R_LT, frame)
    X_AF, p_LQ = np.eye(4), rng.uniform(-0.3, 0.3, 3)
    X_AF[:3, :3], X_AF[:3, 3] = rotation(rng), rng.uniform(-1.0, 1.0, 3)
    p = (np.linalg.inv(X_AF) @ X @ np.append(p_LQ, 1.0))[:3]
    lower, upper = p - room * rng.uniform(0.2, 1.0, 3), p + room * rng.uniform(0.2, 1.0, 3)
    lower[rng.integers(3)] = -np.inf
    return PositionConstraint(link, lower, upper, p_LQ, X_AF, frame)


def robots(tmp_path, seed, *, floats):
    """Return a random robot twice: the tree, and one of matrices."""
    urdf = random_robot(np.random.default_rng(seed), floats=floats)
    return diagram(tmp_path, urdf).tree, PlainRobot(urdf)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("points", [2, 4])
def test_answers_are_true_of_samples(tmp_path, seed, points):
    """Held: no sample is beyond a bound; violated: the place named is; with room: it is held."""
    tree, robot = robots(tmp_path, seed, floats=points == 2 and seed % 2 == 0)
    order = [robot.position_names.index(name) for name in tree.position_names]
    assert len(order) == robot.num_positions
    rng, counts = np.random.default_rng(seed + 100), dict.fromkeys(ConstraintStatus, 0)
    for _ in range(24):
        q = robot.random(rng)
        far = 10.0 ** rng.uniform(-3.0, 0.0)
        edge = q + far * rng.standard_normal((points, len(q)))
        each = random_constraint(rng, robot, edge[0])
        (measure,) = measure_constraints(tree, edge[np.newaxis, :, order], [each])
        counts[measure.status] += 1

        def at(t, edge=edge):
            return slerped(robot, *edge, t) if points == 2 else bezier(edge, t)

        found = [excess(robot, each, at(t)) for t in np.linspace(0.0, 1.0, SAMPLES)]
        if measure.status is ConstraintStatus.HELD:
            assert max(found) <= SLACK, each
            assert measure.at is None and measure.reason is None
        elif measure.status is ConstraintStatus.VIOLATED:
            assert excess(robot, each, at(measure.at)) > 0.0, each
            assert measure.constraint == 0 and each.link in measure.reason
        else:
            assert max(found) > -1e-5, each
    assert counts[ConstraintStatus.HELD] >= 3 and counts[ConstraintStatus.VIOLATED] >= 2
    assert counts[ConstraintStatus.UNDECIDED] <= 2


def test_a_hinge_is_proven_up_to_its_bound(tmp_path):
    """About the axis x an upright vector leaves a cone of 0.3 rad at 0.3 rad, and not before."""
    urdf = """<robot name="one"><link name="base"/><link name="cup"/>
      <joint name="hinge" type="continuous"><parent link="base"/><child link="cup"/>
      <axis xyz="1 0 0"/></joint></robot>"""
    tree = diagram(tmp_path, urdf).tree
    up = AngleBetweenVectorsConstraint("cup", [0, 0, 1], [0, 0, 1], 0.3)
    ends = np.array([0.3, 0.3 - 1e-12, 0.3 + 1e-6, -0.3, 0.29, 2.0 * math.pi])
    edges = np.stack([np.zeros(6), ends], axis=1)[:, :, np.newaxis]
    status = [each.status.name for each in measure_constraints(tree, edges, [up])]
    assert status == ["HELD", "HELD", "VIOLATED", "HELD", "HELD", "VIOLATED"]
    # It is also held on a turn about its own axis, however long that is.
    own = AngleBetweenVectorsConstraint("cup", [1, 0, 0], [1, 0, 0], 1e-4)
    assert measure_constraints(tree, [[[0.0], [50.0]]], [own])[0].status.name == "HELD"
    # From one side of the bound to the other and back: both ends hold, the middle does not.
    curve = np.array([[[0.0], [1.5], [0.0]]])
    assert measure_constraints(tree, curve, [up])[0].status.name == "VIOLATED"


def test_a_bound_that_is_only_touched_counts_as_held(tmp_path):
    """A curve whose fastest point is on the bound, to rounding; and one beyond by a micrometre."""
    urdf = """<robot name="one"><link name="base"/><link name="tool"/>
      <joint name="rail" type="prismatic"><parent link="base"/><child link="tool"/>
      <axis xyz="1 0 0"/><limit lower="-9" upper="9"/></joint></robot>"""
    tree = diagram(tmp_path, urdf).tree
    curve = np.array([[[0.0], [1.0], [0.0]]])  # at most 0.5
    for upper, name in ((0.5, "HELD"), (0.5 - 1e-6, "VIOLATED"), (0.5 + 1e-6, "HELD")):
        box = PositionConstraint("tool", [-1.0] * 3, [upper, 1.0, 1.0])
        (measure,) = measure_constraints(tree, curve, [box])
        assert measure.status.name == name
    assert (
        "constraint 0"
        in measure_constraints(
            tree, curve, [PositionConstraint("tool", [-1.0] * 3, [0.4, 1.0, 1.0])]
        )[0].reason
    )


def test_points_that_are_far_away(tmp_path):
    """A point a thousand kilometres off moves by a metre with a microradian: proven, or not."""
    urdf = """<robot name="one"><link name="base"/><link name="tool"/>
      <joint name="hinge" type="continuous"><parent link="base"/><child link="tool"/>
      <axis xyz="0 0 1"/></joint></robot>"""
    tree = diagram(tmp_path, urdf).tree
    far = PositionConstraint("tool", [-np.inf, -1.0, -np.inf], [np.inf, 1.0, np.inf], [1e6, 0, 0])
    edges = np.array([[[0.0], [0.9e-6]], [[0.0], [1.1e-6]], [[0.0], [3.0]]])
    names = [each.status.name for each in measure_constraints(tree, edges, [far])]
    assert names == ["HELD", "VIOLATED", "VIOLATED"]


def test_a_link_that_no_joint_moves(tmp_path):
    """The base is where it is: held for all edges, or for none."""
    tree, robot = robots(tmp_path, 3, floats=False)
    edges = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2, robot.num_positions))
    box = PositionConstraint("l0", [-0.1] * 3, [0.1] * 3)
    assert {m.status.name for m in measure_constraints(tree, edges, [box])} == {"HELD"}
    box = PositionConstraint("l0", [0.1] * 3, [0.2] * 3)
    assert {m.status.name for m in measure_constraints(tree, edges, [box])} == {"VIOLATED"}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 0], [0, 0, 1], 0.1), "a_A"),
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, np.nan, 1], 0.1), "b_L"),
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, 0, 1], 0.0), "0.0001 rad"),
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, 0, 1], 0.1, 0.2), "reversed"),
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, 0, 1], 4.0), "0 to pi"),
        (lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, 0, 1], np.nan), "angle_upper"),
        (
            lambda: AngleBetweenVectorsConstraint("l1", [0, 0, 1], [0, 0, 1], 0.1, frame="l1"),
            "own",
        ),
        (lambda: OrientationConstraint("l1", np.eye(3), 0.0), "0.0001 rad at least, not 0"),
        (lambda: OrientationConstraint("l1", np.eye(3), np.inf), "theta_bound"),
        (lambda: OrientationConstraint("l1", np.eye(4), 0.1), "R_AT"),
        (lambda: OrientationConstraint("", np.eye(3), 0.1), "link"),
        (lambda: PositionConstraint("l1", [0, 0, 0], [1, 0, 1]), "0.0001 m at least.*in y"),
        (lambda: PositionConstraint("l1", [0, 0, 2], [1, 1, 1]), "1 and 2 in z"),
        (lambda: PositionConstraint("l1", [0, 0, np.nan], [1, 1, 1]), "p_FQ_lower"),
        (lambda: PositionConstraint("l1", [0] * 3, [1] * 3, [np.inf, 0, 0]), "p_LQ"),
        (lambda: PositionConstraint("l1", [0] * 3, [1] * 3, [1e13, 0, 0]), "p_LQ is beyond"),
        (lambda: PositionConstraint("l1", [np.inf] * 3, [np.inf] * 3), "in x"),
    ],
)
def test_bad_constraints_are_refused(make, words):
    """The error names the field, and the value or the least that makes sense."""
    with pytest.raises(PlanningError, match=words):
        make()


def test_bad_arguments_are_refused(tmp_path):
    """Unknown links and frames, edges of another shape, too many constraints and other things."""
    tree, robot = robots(tmp_path, 1, floats=True)
    nq = robot.num_positions
    edges = np.ones((1, 2, nq))
    box = PositionConstraint("l1", [0] * 3, [1] * 3)
    with pytest.raises(KinematicTreeError, match="nowhere"):
        measure_constraints(tree, edges, [PositionConstraint("nowhere", [0] * 3, [1] * 3)])
    far = PositionConstraint("l1", [0] * 3, [1] * 3, frame="nowhere")
    with pytest.raises(KinematicTreeError, match="nowhere"):
        measure_constraints(tree, edges, [far])
    for bad in (edges[0], edges[:, :1], edges[:, :, :-1]):
        with pytest.raises(PlanningError, match="edges must have shape"):
            measure_constraints(tree, bad, [box])
    with pytest.raises(KinematicTreeError):
        measure_constraints(tree, edges * np.nan, [box])
    turning = np.random.default_rng(0).uniform(0.0, 1.0, (1, 3, nq))
    with pytest.raises(PlanningError, match="floats, must not turn"):
        measure_constraints(tree, turning, [box])
    for bad in (box, 3, ["upright"], None):
        with pytest.raises(PlanningError, match="constraints must be"):
            measure_constraints(tree, edges, bad)
    with pytest.raises(PlanningError, match="32 at most, and there are 33"):
        measure_constraints(tree, edges, [box] * 33)
    assert len(measure_constraints(tree, edges[:0], [box])) == 0
    assert measure_constraints(tree, edges, [])[0].status is ConstraintStatus.HELD


def test_a_checker_is_taken_as_its_tree_is(tmp_path):
    """Both have the same answers."""
    urdf = random_robot(np.random.default_rng(5), floats=False)
    made = diagram(tmp_path, urdf)
    edges = np.random.default_rng(0).uniform(-1.0, 1.0, (9, 2, made.tree.num_positions))
    box = PositionConstraint("l6", [-1.0] * 3, [1.0] * 3)
    checker = SceneGraphCollisionChecker(made)
    for one, other in zip(
        measure_constraints(checker, edges, [box]),
        measure_constraints(made.tree, edges, [box]),
        strict=True,
    ):
        assert one == other
