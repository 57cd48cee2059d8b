"""Polytopes that are proven free by planes, against answers known by construction."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
import math
from types import SimpleNamespace

from certified_arm import arm_between_posts, BOX, free_box
import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, PLATE, ROD, SLIDE

from scene_graph_ros.convex.solve.sums_of_squares.weighted_squares import minimize_over_squares
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.planning import (
    BilinearAlternationOptions,
    BinarySearchOptions,
    CertificateError,
    CspaceFreePolytope,
    EllipsoidMarginCost,
    PairCertificate,
    PairFailure,
    RationalForwardKinematics,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.certified import bilinear_alternation, plane_search
from scene_graph_ros.planning.certified.growth_program import grown_rows
from scene_graph_ros.planning.certified.pair_problem import PairProblems
from scene_graph_ros.planning.certified.pair_shapes import rounded_hull
from scene_graph_ros.planning.certified.tangent_region import make_region

# Four joints, one of them sliding, with axes in all directions, and one that follows another.
CRANE = """<robot name="crane"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
  <link name="d"/><link name="e"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="a"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="j2" type="prismatic"><parent link="a"/><child link="b"/>
  <origin xyz="0.3 0 0.1" rpy="0 0.5 0"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="j3" type="revolute"><parent link="b"/><child link="c"/>
  <origin xyz="0 0.4 0" rpy="1 0 0"/><axis xyz="0 1 0"/>
  <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="j4" type="revolute"><parent link="a"/><child link="d"/>
  <origin xyz="0.2 0 0" rpy="0 1 0"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="j5" type="revolute"><parent link="d"/><child link="e"/>
  <origin xyz="0.2 0 0.1"/><axis xyz="1 0 0"/><mimic joint="j3" multiplier="-1" offset="0.2"/>
  <limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""


def checker(folder, urdf, scene):
    """Return the checker of a robot in a scene."""
    return SceneGraphCollisionChecker(diagram(folder, urdf, scene))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return arm_between_posts(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def proven(arm):
    """A box of tangents in which the arm is free."""
    return free_box(arm)


def value_of(polynomial, u):
    """Return a polynomial's value in floats."""
    return sum(float(c) * np.prod(np.power(u, e)) for e, c in polynomial.items())


def pose_at(pose, u):
    """Return a rational pose ``(4, 4)`` at u."""
    rows = [[value_of(entry, u) for entry in row] for row in pose.matrix]
    return np.vstack([np.array(rows) / value_of(pose.denominator, u), [0.0, 0.0, 0.0, 1.0]])


@pytest.mark.parametrize(("A", "B"), [("c", "e"), ("c", "base"), ("base", "e"), ("d", "c")])
def test_rational_kinematics_are_those_of_the_tree(tmp_path, A, B):
    """Two links seen from the frame between them are as the tree's own poses have them."""
    tree = diagram(tmp_path, CRANE).tree
    kinematics = RationalForwardKinematics(tree, [0.3, 0.1, -0.4, 0.2])
    region = make_region(kinematics, np.concatenate([np.eye(4), -np.eye(4)]), np.full(8, 0.4))
    variables, u = [0, 1, 2, 3], np.array([0.9, -0.3, 0.6, -0.8])
    rows = [tree.link_index(name) for name in (A, B)]
    paths = kinematics.path_between(*(tree.joint_of_link[row] for row in rows))
    X_EA, X_EB = (
        pose_at(
            kinematics.pose(tree.X_JL[row][:3], path, region.stretches(variables), variables), u
        )
        for row, path in zip(rows, paths, strict=True)
    )
    q = kinematics.compute_q_value(0.4 * u)
    X_WA, X_WB = tree.link_poses(q, [A, B])
    np.testing.assert_allclose(np.linalg.inv(X_EB) @ X_EA, np.linalg.inv(X_WB) @ X_WA, atol=1e-12)


def test_s_and_q_are_each_others(arm):
    """The tangent of half the way from q_star, and the limits with it."""
    kinematics = RationalForwardKinematics(arm.plan.tree, [0.5, -0.5])
    s = kinematics.compute_s_value([1.5, -0.5])
    np.testing.assert_allclose(s, [math.tan(0.5), 0.0])
    np.testing.assert_allclose(kinematics.compute_q_value(s), [1.5, -0.5])
    lower, upper = kinematics.s_limits()
    assert upper[0] == pytest.approx(math.tan(1.25))
    assert lower[1] == pytest.approx(math.tan(-1.15))
    with pytest.raises(CertificateError, match="'shoulder' must be less than half a turn"):
        kinematics.compute_s_value([4.0, 0.0])


def test_a_proven_box_is_free_and_verifies(arm, proven):
    """Nobody finds a collision in it; what is kept is no more than what is there."""
    assert proven.verify()
    q = np.random.default_rng(3).uniform(-0.4, 0.4, (20_000, 2))
    inside = q[proven.contains(q)]
    assert len(inside) > 1000
    assert arm.check_configs_collision_free(inside).all()
    least = min(arm.calc_robot_clearance(each, 1.0).distances.min() for each in inside[:300])
    assert 0.0 < proven.distance <= least
    assert set(proven.certificates) == {arm.plan.ids(k) for k in range(arm.num_pairs)}


def test_a_plane_is_beside_all_corners(arm, proven):
    """The plane of each pair, evaluated in floats, has the two shapes on its two sides."""
    for certificate in proven.certificates.values():
        n = len(certificate.problem.variables)
        plane = np.array(certificate.plane, dtype=np.float64)
        for u in np.random.default_rng(5).uniform(-1.0, 1.0, (20, n)):
            *normal, offset = plane @ [1.0, *u]
            assert np.linalg.norm(normal) <= 1.0
            for side in certificate.problem.sides:
                corners = np.column_stack([side.hull.points, np.ones(len(side.hull.points))])
                p_Es = (corners @ pose_at(side.pose, u).T)[:, :3]
                beside = side.sign * (p_Es @ normal + offset)
                assert (beside >= side.radius + float(certificate.clearance) - 1e-12).all()


def test_a_ball_on_a_rail_is_proven_up_to_the_other(tmp_path):
    """A ball of 0.1 m meets one of 0.2 m at 1 m from 0.7 m on; less where there is padding."""
    rail = checker(tmp_path, SLIDE, BALL)
    options = BinarySearchOptions(max_iter=30, convergence_tol=1e-6)
    for padding in (0.0, 0.05):
        rail.set_padding_all_robot_environment_pairs(padding)
        found = CspaceFreePolytope(rail).binary_search(
            [[1.0], [-1.0]], [2.0, 2.0], [0.0], options=options
        )
        assert found.verify()
        assert found.region.upper[0] == pytest.approx(0.7 - padding, abs=1e-5)
        assert found.region.upper[0] <= 0.7 - padding


def test_a_rod_is_proven_up_to_a_plate(tmp_path):
    """It meets a plate of a tenth of a millimetre at an angle of 0.5; q_star may be anywhere."""
    rod = checker(tmp_path, ROD, PLATE)
    for q_star in ([0.0], [-0.3]):
        search = CspaceFreePolytope(rod, q_star)
        center = search.rational_forward_kinematics.compute_s_value([-0.1])
        found = search.binary_search(
            [[1.0], [-1.0]],
            [center[0] + 1.0, 1.0 - center[0]],
            center,
            options=BinarySearchOptions(max_iter=30, convergence_tol=1e-6),
        )
        end = search.rational_forward_kinematics.compute_q_value(found.region.upper)
        assert found.verify()
        assert 0.49 < end[0] < 0.5


def test_a_polytope_on_a_rail_grows_up_to_the_ball(tmp_path):
    """Faces move to where the ball of 0.1 m meets the other at 0.7 m, and to the limit of -9 m."""
    rail = checker(tmp_path, SLIDE, BALL)
    options = BilinearAlternationOptions(max_iter=12, convergence_tol=1e-4)
    found = CspaceFreePolytope(rail).search_with_bilinear_alternation(
        [[1.0], [-1.0]], [0.3, 0.3], options=options
    )
    ends = [each.region.polyhedron.support([1.0]).value for each in found]
    assert 0.699 < ends[-1] <= 0.7 and ends == sorted(ends)
    assert found[-1].region.polyhedron.support([-1.0]).value > 8.0
    assert all(each.verify() for each in found)


def test_a_polytope_grows_around_its_ellipsoid(arm):
    """Each has the ellipsoid of the one before in it; nothing collides in the last."""
    options = BilinearAlternationOptions(max_iter=2, ellipsoid_scaling=0.99)
    search = CspaceFreePolytope(arm)
    found = search.search_with_bilinear_alternation(BOX, np.full(4, 0.1), options=options)
    assert len(found) == 3 and found[-1].verify()
    np.testing.assert_array_equal(found[0].region.upper, [0.1, 0.1])
    volumes = [each.certified_polytope.calc_volume() for each in found]
    assert volumes[0] == pytest.approx(0.04)
    assert volumes[1] > 2.0 * volumes[0] and volumes[2] > 2.0 * volumes[1]
    circle = 0.1 * np.array([[np.cos(t), np.sin(t)] for t in np.linspace(0.0, 2.0 * np.pi, 100)])
    assert found[1].region.contains(0.98 * circle).all()
    q = np.random.default_rng(8).uniform(-1.5, 1.5, (20_000, 2))
    inside = q[found[-1].contains(q)]
    assert len(inside) > 1000 and arm.check_configs_collision_free(inside).all()
    assert search.search_with_bilinear_alternation(BOX, np.full(4, 0.3), options=options) == []


def test_points_that_are_to_stay_inside_do(arm):
    """A corner of a box, from which a face that turns moves away otherwise."""
    kept = ((0.1, 0.1), (-0.1, 0.05))
    search = CspaceFreePolytope(arm)
    held = []
    for points in ((), kept):
        options = BilinearAlternationOptions(max_iter=3, s_inner_pts=points)
        found = search.search_with_bilinear_alternation(BOX, np.full(4, 0.1), options=options)
        assert len(found) > 1 and found[-1].verify()
        held.append([bool(each.region.contains(np.array(kept)).all()) for each in found])
    assert not held[0][-1]
    assert all(held[1])


def test_faces_move_by_the_sum_of_margins_or_by_their_geometric_mean(arm, monkeypatch):
    """In a first round, where all else is the same, each is largest where it is asked for."""
    margins = {}

    def watched(problems, solutions, region, B, center, options):
        C, d = grown_rows(problems, solutions, region, B, center, options)
        away = d - C @ center - np.linalg.norm(C @ B, axis=1)
        margins.setdefault(options.ellipsoid_margin_cost, away)
        return C, d

    monkeypatch.setattr(bilinear_alternation, "grown_rows", watched)
    for cost in EllipsoidMarginCost:
        options = BilinearAlternationOptions(max_iter=1, ellipsoid_margin_cost=cost)
        found = CspaceFreePolytope(arm).search_with_bilinear_alternation(
            BOX, np.full(4, 0.1), options=options
        )
        assert len(found) == 2 and found[1].verify()
    by_sum, by_mean = (margins[cost] for cost in EllipsoidMarginCost)
    assert len(by_sum) == len(by_mean) == 4
    assert by_sum.sum() > by_mean.sum() + 1e-4
    assert (by_mean + 1e-5).prod() > 1.001 * (by_sum + 1e-5).prod()


def test_rows_that_tie_joints_are_used(arm):
    """A cut corner of a box that is not free leaves what is."""
    search = CspaceFreePolytope(arm)
    assert not search.find_separation_certificate_given_polytope(BOX, np.full(4, 0.2)).is_success
    C, d = np.concatenate([BOX, [[1.0, 1.0]]]), np.array([0.2, 0.2, 0.2, 0.2, 0.3])
    found = search.find_separation_certificate_given_polytope(C, d)
    assert found.is_success and found.verify()
    assert found.certified_polytope.point_in_set([0.14, 0.14])
    assert not found.certified_polytope.point_in_set([0.16, 0.16])


def test_a_collision_is_never_certified(arm):
    """It is named with where it is; the program by itself finds no plane, either."""
    search = CspaceFreePolytope(arm)
    found = search.find_separation_certificate_given_polytope(BOX, np.full(4, 0.3))
    assert not found.is_success and not found.verify()
    ((pair, failure),) = found.failures.items()
    assert failure.status == "collision" and "ball" in failure.names
    assert not arm.check_config_collision_free(failure.q)
    alone = search.find_pair_certificate(pair, BOX, np.full(4, 0.3))
    assert isinstance(alone, PairFailure)
    assert alone.status == "no_plane" and alone.clearance <= 0.0
    others = search.find_separation_certificate_given_polytope(BOX, np.full(4, 0.3), [pair])
    assert others.is_success and others.verify() and pair not in others.certificates
    assert search.binary_search(BOX, np.full(4, 0.3), [0.25, 0.25]) is None


def test_one_pair_and_an_executor_give_the_same(arm, proven):
    """Single pairs, and threads, give the certificates of the whole."""
    search = CspaceFreePolytope(arm)
    pair = search.geometry_pairs[0]
    alone = search.find_pair_certificate(pair, BOX, np.full(4, 0.15))
    assert isinstance(alone, PairCertificate) and alone.verify()
    with ThreadPoolExecutor(2) as pool:
        shared = search.find_separation_certificate_given_polytope(
            BOX, np.full(4, 0.15), executor=pool
        )
    assert {k: c.plane for k, c in shared.certificates.items()} == {
        k: c.plane for k, c in proven.certificates.items()
    }


FLOOR = """
geometries:
  - {name: floor, source: around, pose: {xyz: [0, 0, -0.5], rpy: [0.3, 0, 0]},
     shape: {type: half_space}}
"""

# A rod of 1 m that is lifted and lowered by a hinge along y.
LEVER = ROD.replace('xyz="0 0 1"', 'xyz="0 1 0"')


def test_a_lever_is_proven_down_to_a_floor(tmp_path):
    """Its corners meet a tilted half space where their height above it is zero, and padding."""
    lever = checker(tmp_path, LEVER, FLOOR)
    search = CspaceFreePolytope(lever)
    options = BinarySearchOptions(max_iter=30, convergence_tol=1e-7)
    normal = np.array([0.0, -np.sin(0.3), np.cos(0.3)])
    corners = np.array([[1.0, y, z] for y in (-5e-4, 5e-4) for z in (-5e-4, 5e-4)])

    def height(q):
        c, s = np.cos(q), np.sin(q)
        turned = corners @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]).T
        return ((turned - [0.0, 0.0, -0.5]) @ normal).min()

    found = search.binary_search([[1.0], [-1.0]], [1.0, 1.0], [0.0], options=options)
    end = search.rational_forward_kinematics.compute_q_value(found.region.upper)[0]
    assert found.verify()
    assert 0.0 <= height(end) < 1e-3
    assert height(end) >= found.distance
    ((pair, certificate),) = found.certificates.items()
    lower = replace(certificate, plane=(*certificate.plane[:3], (certificate.plane[3][0] - 1, 0)))
    assert not lower.verify()
    assert not replace(found, certificates={pair: lower}).verify()


@pytest.mark.parametrize(
    ("shape", "support"),
    [
        (Cylinder(0.3, 0.8), lambda d: 0.3 * np.hypot(d[0], d[1]) + 0.4 * abs(d[2])),
        (Ellipsoid(0.2, 0.3, 0.4), lambda d: np.linalg.norm(d * [0.2, 0.3, 0.4])),
        (Capsule(0.3, 0.8), lambda d: 0.3 + 0.4 * abs(d[2])),
        (Box(0.2, 0.4, 0.6), lambda d: np.abs(d) @ [0.1, 0.2, 0.3]),
        (Sphere(0.3), lambda d: 0.3),
    ],
)
def test_what_is_proven_is_around_the_shape(shape, support):
    """In no direction does a shape reach farther than the points and the radius around them."""
    hull = rounded_hull(shape, "shape")
    directions = np.random.default_rng(9).normal(size=(500, 3))
    for way in directions / np.linalg.norm(directions, axis=1)[:, np.newaxis]:
        assert (hull.points @ way).max() + hull.radius >= support(way) - 1e-12


def test_the_solver_for_all_cones_proves_the_same(arm, proven, monkeypatch):
    """Where the method for planes gives up, the other one's planes are proven like its own."""

    def gives_up(*arguments, **options):
        return replace(minimize_over_squares(*arguments, **options), is_solved=False, bound=-9.0)

    monkeypatch.setattr(plane_search, "minimize_over_squares", gives_up)
    found = CspaceFreePolytope(arm).find_separation_certificate_given_polytope(
        BOX, np.full(4, 0.15)
    )
    assert found.is_success and found.verify()
    for pair, certificate in found.certificates.items():
        assert (
            certificate.grams[0].whole.tolist()
            != proven.certificates[pair].grams[0].whole.tolist()
        )
        assert certificate.distance == pytest.approx(proven.certificates[pair].distance, rel=1e-3)


def test_bad_arguments_are_named(arm, tmp_path):
    """Each message says which argument, and what it was."""
    search = CspaceFreePolytope(arm)
    find = search.find_separation_certificate_given_polytope
    with pytest.raises(CertificateError, match=r"C and d must have the shapes \(m, 2\)"):
        find(np.eye(3), np.ones(3))
    with pytest.raises(CertificateError, match="d must be finite"):
        find(BOX, [1.0, 1.0, 1.0, np.nan])
    with pytest.raises(CertificateError, match="C: row 0 is zero"):
        find(0.0 * BOX, np.ones(4))
    with pytest.raises(CertificateError, match="no point in common"):
        find(BOX, [-1.0, 1.0, -1.0, 1.0])
    with pytest.raises(CertificateError, match="no width along 'shoulder'"):
        find(BOX, [0.0, 1.0, 0.0, 1.0])
    with pytest.raises(CertificateError, match="are no pair that is checked"):
        find(BOX, np.ones(4), [(1, 10**9)])
    with pytest.raises(CertificateError, match="s_center must be in the polytope"):
        search.binary_search(BOX, np.full(4, 0.1), [0.5, 0.0])
    with pytest.raises(CertificateError, match="scale_min and scale_max must be positive"):
        BinarySearchOptions(scale_min=2.0)
    with pytest.raises(CertificateError, match=r"ellipsoid_scaling must be in \(0, 1\]"):
        BilinearAlternationOptions(ellipsoid_scaling=1.5)
    with pytest.raises(CertificateError, match="must be an EllipsoidMarginCost, not 'sum'"):
        BilinearAlternationOptions(ellipsoid_margin_cost="sum")
    with pytest.raises(CertificateError, match="ellipsoid_margin_epsilon must be positive"):
        BilinearAlternationOptions(ellipsoid_margin_epsilon=0.0)
    for point, words in (([0.5, 0.0], "must be in the polytope"), ([0.0], "2 finite numbers")):
        outside = BilinearAlternationOptions(s_inner_pts=[[0.0] * len(point), point])
        with pytest.raises(CertificateError, match=rf"s_inner_pts\[[01]\] must be .*{words[8:]}"):
            search.search_with_bilinear_alternation(BOX, np.full(4, 0.1), options=outside)
    with pytest.raises(CertificateError, match="max_iter must be a whole number"):
        BilinearAlternationOptions(max_iter=-1)
    with pytest.raises(CertificateError, match="checker must be a SceneGraphCollisionChecker"):
        CspaceFreePolytope(arm.plan)
    with pytest.raises(CertificateError, match="'free' is planar or floating"):
        CspaceFreePolytope(checker(tmp_path, DRONE, BALL))


def test_a_half_space_that_a_robot_carries_is_refused(arm):
    """It has no points that a plane could be beside, so nothing would be shown of it."""
    inspector = SimpleNamespace(get_shape=lambda _: HalfSpace(), get_name=lambda _: "carried")
    kinematics = RationalForwardKinematics(arm.plan.tree)
    region = make_region(kinematics, BOX, np.full(4, 0.1))
    with pytest.raises(CertificateError, match="'carried': a half space that a robot carries"):
        PairProblems(kinematics, arm.plan, inspector, region).make(0)
