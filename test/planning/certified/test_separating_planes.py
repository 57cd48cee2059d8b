"""What certificates are made of: planes, multipliers, programs and options, checked apart."""

from dataclasses import replace
from fractions import Fraction

from certified_arm import arm_between_posts, BOX, free_box
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Sphere
from scene_graph_ros.planning import (
    BilinearAlternationOptions,
    BinarySearchOptions,
    CertificateError,
    CspaceFreeBox,
    CspaceFreePolytope,
    EllipsoidMarginCost,
    PairCertificate,
)
from scene_graph_ros.planning.certified import (
    bilinear_alternation,
    CIrisGeometryType,
    FindPolytopeGivenLagrangianOptions,
    FindSeparationCertificateGivenPolytopeOptions,
    FindSeparationCertificateOptions,
    PlaneSide,
    SeparatingPlaneOrder,
    SeparationCertificateProgram,
)
from scene_graph_ros.planning.certified.growth_program import grown_rows


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return arm_between_posts(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def search(arm):
    """A search for polytopes of the arm."""
    return CspaceFreePolytope(arm)


@pytest.fixture(scope="module")
def proven(arm):
    """A box of tangents in which the arm is free."""
    return free_box(arm)


@pytest.fixture(scope="module")
def cut():
    """A box of tangents, a row across it, and one that it implies."""
    return np.concatenate([BOX, [[1.0, 1.0], [1.0, 1.0]]]), np.array([*[0.15] * 4, 0.2, 0.5])


def frame_pose(tree, body, q):
    """Return the pose of the frame that a plane is in at q."""
    return tree.X_WB if body is None else tree.link_poses(q, [body])[0]


def hull_points(geometry):
    """Return points (k, 3) of a shape's hull, and the radius around them, from its sizes."""
    shape = geometry.geometry
    if isinstance(shape, Sphere):
        return np.zeros((1, 3)), shape.radius
    if isinstance(shape, Capsule):
        return np.array([[0, 0, 0.5], [0, 0, -0.5]]) * shape.length, shape.radius
    assert isinstance(shape, Box)
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return signs * 0.5 * shape.size, 0.0


def placed_points(tree, plane, side, q):
    """Return a geometry's hull in the frame of a plane by the tree's own kinematics."""
    geometry = plane.geometry(side)
    points, radius = hull_points(geometry)
    X_WB = np.eye(4)
    if geometry.body_name != "world":
        X_WB = tree.link_poses(q, [geometry.body_name])[0]
    X_EG = np.linalg.inv(frame_pose(tree, plane.expressed_body, q)) @ X_WB @ geometry.X_BG
    return points @ X_EG[:3, :3].T + X_EG[:3, 3], radius


def test_planes_are_between_their_geometries_by_the_robots_own_kinematics(search, proven, arm):
    """At points all over the region, each geometry is beside its plane by the clearance."""
    tree = arm.plan.tree
    s = np.random.default_rng(3).uniform(-0.15, 0.15, (20, 2))
    for certificate in proven.certificates.values():
        plane = search.separating_planes[certificate.plane_index]
        assert plane.plane_degree is SeparatingPlaneOrder.AFFINE
        a, b = certificate.a(s), certificate.b(s)
        assert (np.linalg.norm(a, axis=1) <= 1.0).all()
        for k, q in enumerate(proven.kinematics.compute_q_value(s)):
            for side, sign in ((PlaneSide.POSITIVE, 1.0), (PlaneSide.NEGATIVE, -1.0)):
                p, radius = placed_points(tree, plane, side, q)
                least = (sign * (p @ a[k] + b[k])).min() - radius
                assert least >= float(certificate.clearance) - 1e-12


def test_planes_know_their_pairs(search, arm):
    """The map, the ids of both sides and the bodies agree with the checker's."""
    planes = search.separating_planes
    indices = search.map_geometries_to_separating_planes
    assert len(planes) == len(indices) == arm.num_pairs
    assert CspaceFreeBox(arm).map_geometries_to_separating_planes == indices
    for pair, index in indices.items():
        plane = planes[index]
        ids = {plane.positive_side_geometry.id, plane.negative_side_geometry.id}
        assert ids == set(pair[:2])
        for each in (plane.positive_side_geometry, plane.negative_side_geometry):
            frame = arm.snapshot.inspector.get_frame_id(each.id)
            assert arm.bodies[each.body_index].frame_id == frame
            points, _ = hull_points(each)
            assert each.num_rationals == len(points)
            kinds = {Box: CIrisGeometryType.POLYTOPE, Sphere: CIrisGeometryType.SPHERE}
            assert each.type is kinds.get(type(each.geometry), CIrisGeometryType.CAPSULE)


def test_multipliers_show_each_numerator(search, cut):
    """A numerator less its multipliers times the rows is not negative, and small."""
    C, d = cut
    found = search.find_separation_certificate_given_polytope(C, d)
    assert found.is_success, found.failures
    lower, upper = found.s_bounds
    s = np.random.default_rng(5).uniform(lower, upper, (40, 2))
    s = s[found.region.contains(s)]
    for certificate in found.certificates.values():
        own = certificate.problem
        a, b = certificate.a(s), certificate.b(s)[:, 0]
        variables = list(own.variables)
        middle = np.array([float(x.middle) for x in own.stretches])
        half = np.array([float(x.half) for x in own.stretches])
        u = (s[:, variables] - middle) / half
        both = (
            (own.sides[0], certificate.positive_side_rational_lagrangians),
            (own.sides[1], certificate.negative_side_rational_lagrangians),
        )
        for side, multipliers in both:
            assert len(multipliers) == len(side.hull.points)
            for point, lagrangians in zip(side.numerators, multipliers, strict=True):
                monomials = np.array(
                    [np.prod(u ** np.array(e), axis=1) for e in side.monomials.products]
                )
                x, w = point[:3] @ monomials, point[3] @ monomials
                value = side.sign * (np.einsum("ni,in->n", a, x) + b * w)
                value -= (side.radius + float(certificate.clearance)) * w
                rest = value - lagrangians.constant(s)
                rows = np.array(lagrangians.rows, dtype=int)
                for number, each in zip(rows, lagrangians.polytope, strict=True):
                    assert (each(s) >= 0.0).all()
                    rest -= each(s) * (found.d[number] - s @ found.C[number])
                for k, low, high in zip(
                    lagrangians.positions, lagrangians.s_lower, lagrangians.s_upper, strict=True
                ):
                    assert (low(s) >= 0.0).all() and (high(s) >= 0.0).all()
                    rest -= low(s) * (s[:, k] - lower[k]) + high(s) * (upper[k] - s[:, k])
                # The rest of the clearance that is kept for squares is at most 1 / 1024 of it.
                assert (rest >= -1e-12).all() and (rest <= 1e-2).all()


def test_geometries_of_planes_are_those_of_the_scene(search, arm):
    """Their shapes, types and poses, where the scene has them with the robot at any positions."""
    q = np.array([0.4, -0.7])
    arm.update_positions(q)
    query = arm.model_context().query_object()
    types = {
        Sphere: CIrisGeometryType.SPHERE,
        Capsule: CIrisGeometryType.CAPSULE,
        Box: CIrisGeometryType.POLYTOPE,
    }
    points = {Sphere: 1, Capsule: 2, Box: 8}
    for plane in search.separating_planes:
        for side in PlaneSide:
            geometry = plane.geometry(side)
            kind = type(geometry.geometry)
            assert query.inspector().get_shape(geometry.id) == geometry.geometry
            assert geometry.type is types[kind] and geometry.num_rationals == points[kind]
            X_WB = np.eye(4)
            if geometry.body_name != "world":
                X_WB = arm.plan.tree.link_poses(q, [geometry.body_name])[0]
            X_WG = query.get_pose_in_world(geometry.id)
            np.testing.assert_allclose(X_WB @ geometry.X_BG, X_WG, atol=1e-15)


def test_coefficients_are_those_of_the_plane(proven):
    """The vector has each coordinate's constant, then its factors."""
    certificate = next(iter(proven.certificates.values()))
    values = certificate.plane_decision_var_vals.reshape(4, 3)
    s = np.array([0.03, -0.07])
    np.testing.assert_allclose(values[:3] @ [1.0, *s], certificate.a(s), atol=1e-15)
    np.testing.assert_allclose(values[3:] @ [1.0, *s], certificate.b(s), atol=1e-15)
    assert isinstance(certificate.a.constant[0], Fraction)
    assert proven.a[certificate.plane_index](s).shape == (3,)
    assert proven.b[certificate.plane_index](s).shape == (1,)
    with pytest.raises(CertificateError, match=r"s must have shape \(\.\.\., 2\)"):
        certificate.a([1.0, 2.0, 3.0])


def test_a_program_of_one_pair_is_solved_apart_and_by_hand(search, cut):
    """The same plane's clearance by the method of our own, by Clarabel, and by the program."""
    C, d = cut
    pair = search.geometry_pairs[0]
    program = search.make_is_geometry_separable_program(pair, C, d)
    assert isinstance(program, SeparationCertificateProgram)
    assert program.plane_index == search.map_geometries_to_separating_planes[pair]
    own = search.solve_separation_certificate_program(program)
    other = search.solve_separation_certificate_program(
        program, FindSeparationCertificateOptions(solver_id="clarabel")
    )
    assert isinstance(own, PairCertificate) and isinstance(other, PairCertificate)
    assert own.verify() and other.verify()
    by_hand = program.certificate.solution(program.prog.solve("the plane").x)
    for found in (own, other):
        # 0.999 of the clearance is kept, if that is proven.
        assert float(found.clearance) == pytest.approx(0.999 * by_hand.clearance, rel=1e-3)


def test_redundant_rows_are_left_out_of_a_proof_of_the_same_region(search, cut):
    """The row that the box implies has no multipliers; what is proven is the same."""
    C, d = cut
    options = FindSeparationCertificateGivenPolytopeOptions(ignore_redundant_C=True)
    found = search.find_separation_certificate_given_polytope(C, d, (), options)
    assert found.is_success and found.verify()
    np.testing.assert_array_equal(found.C, [[1.0, 1.0]])
    np.testing.assert_array_equal(found.d, [0.2])
    whole = search.find_separation_certificate_given_polytope(C, d)
    assert len(whole.d) == 2
    for k in range(2):
        np.testing.assert_allclose(found.s_bounds[k], whole.s_bounds[k])


def test_options_switch_off_what_arguments_leave_on(search):
    """A region that is not free has as many failures as the options let it look for."""
    wide = np.full(4, 1.5)
    kept = FindSeparationCertificateGivenPolytopeOptions(terminate_at_failure=False)
    several = search.find_separation_certificate_given_polytope(BOX, wide, (), kept)
    assert not several.is_success


def test_binary_search_counts_its_rounds(search):
    """Halving from [0.1, 1] to within 0.3 takes two rounds; a success at once takes none."""
    d = np.full(4, 1.5)
    options = BinarySearchOptions(scale_min=0.1, convergence_tol=0.3)
    found = search.binary_search(BOX, d, [0.0, 0.0], options=options)
    assert found.num_iter == 2
    assert search.binary_search(BOX, 0.1 * d, [0.0, 0.0]).num_iter == 0


@pytest.fixture(scope="module")
def grown(search):
    """How far one round grows a small box, by options of the faces' program."""

    def volume_of(**faces):
        options = BilinearAlternationOptions(
            max_iter=1, find_polytope_options=FindPolytopeGivenLagrangianOptions(**faces)
        )
        found = search.search_with_bilinear_alternation(BOX, np.full(4, 0.1), options=options)
        assert [each.num_iter for each in found] == list(range(len(found)))
        return found

    return volume_of


def test_faces_that_give_up_some_of_their_cost_leave_planes_more(grown):
    """Half of the margins given up: a smaller polytope whose pairs keep more clearance."""
    start, best = grown()
    backed_off = grown(backoff_scale=0.5)[-1]
    volumes = [each.certified_polytope.calc_volume() for each in (best, backed_off)]
    assert 0.04 < volumes[1] < volumes[0]

    def kept(found):
        # The least share of a pair's clearance is what the faces' program looks for.
        return min(
            each.clearance / start.certificates[pair].clearance
            for pair, each in found.certificates.items()
        )

    assert kept(backed_off) > kept(best)
    assert backed_off.verify()


def test_bounds_multipliers_may_stay_as_they_are(grown, monkeypatch):
    """The smaller program's faces have no larger sum of margins, and are proven as well."""
    sums = []

    def watched(problems, solutions, region, B, center, options):
        C, d = grown_rows(problems, solutions, region, B, center, options)
        sums.append((d - C @ center - np.linalg.norm(C @ B, axis=1)).sum())
        return C, d

    monkeypatch.setattr(bilinear_alternation, "grown_rows", watched)
    grown()
    assert grown(search_s_bounds_lagrangians=False)[-1].verify()
    assert 0.0 < sums[1] < sums[0] - 1e-6


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: FindSeparationCertificateOptions(solver_id="mosek"), "solver_id must be one of"),
        (lambda: FindSeparationCertificateOptions(terminate_at_failure=1), "must be True or Fal"),
        (lambda: FindPolytopeGivenLagrangianOptions(backoff_scale=1.0), "backoff_scale"),
        (lambda: FindPolytopeGivenLagrangianOptions(search_s_bounds_lagrangians=0), "must be Tr"),
        (lambda: BinarySearchOptions(find_lagrangian_options=3), "find_lagrangian_options must"),
        (lambda: BilinearAlternationOptions(find_polytope_options={}), "find_polytope_options m"),
        (
            lambda: BilinearAlternationOptions(
                ellipsoid_margin_cost=EllipsoidMarginCost.GEOMETRIC_MEAN,
                find_polytope_options=FindPolytopeGivenLagrangianOptions(),
            ),
            "give them there",
        ),
    ],
)
def test_options_that_make_no_sense_are_refused(make, says):
    """By name."""
    with pytest.raises(CertificateError, match=says):
        make()


def test_options_are_values_that_can_be_changed():
    """A copy with another number of rounds keeps the faces' options."""
    faces = FindPolytopeGivenLagrangianOptions(s_inner_pts=[[0.0, 0.0]])
    options = replace(BilinearAlternationOptions(find_polytope_options=faces), max_iter=3)
    assert options.faces == faces and options.max_iter == 3


def test_other_arguments_are_refused(search):
    """A program must be one, and options must be options."""
    with pytest.raises(CertificateError, match="certificate_program must be a"):
        search.solve_separation_certificate_program(3)
    with pytest.raises(CertificateError, match="options must be Find"):
        search.find_separation_certificate_given_polytope(BOX, np.full(4, 0.1), (), {"a": 1})


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (FindPolytopeGivenLagrangianOptions, ("backoff_scale", "ellipsoid_margin_epsilon")),
        (BinarySearchOptions, ("scale_min", "scale_max", "convergence_tol")),
        (BilinearAlternationOptions, ("convergence_tol", "ellipsoid_scaling")),
    ],
)
def test_numbers_of_options_are_numbers(kind, names):
    """Text, lists and truth values are none, and are named."""
    for name in names:
        for wrong in ("0.5", [0.5], True, float("nan")):
            with pytest.raises(CertificateError, match=name):
                kind(**{name: wrong})
    for wrong in ([0.0], 0.0, [[[0.0]]]):
        with pytest.raises(CertificateError, match=r"s_inner_pts must be numbers \(m, nq\), not"):
            BilinearAlternationOptions(s_inner_pts=wrong)


def test_what_is_no_pair_no_side_and_no_options_is_refused(search, cut):
    """By name and value, in all searches."""
    C, d = cut
    pair = search.geometry_pairs[0]
    plane = search.separating_planes[0]
    for ask, says in (
        (lambda: search.find_pair_certificate("no", C, d), "geometries 'no' are no pair"),
        (lambda: search.find_pair_certificate(None, C, d), "geometries None are no pair"),
        (lambda: search.find_pair_certificate((*pair, 0.5), C, d), None),
        (
            lambda: search.find_separation_certificate_given_polytope(C, d, 3),
            "ignored_collision_pairs must",
        ),
        (
            lambda: search.binary_search(C, d, [0.0, 0.0], 3),
            "^ignored_collision_pairs must be pairs of .*, not 3",
        ),
        (lambda: search.binary_search(C, d, [0.0, 0.0], options=3), "be BinarySearchOptions"),
        (
            lambda: search.search_with_bilinear_alternation(C, d, options="no"),
            "options must be BilinearAlternationOptions, not 'no'",
        ),
        (lambda: plane.geometry("positive"), "side must be a PlaneSide, not 'positive'"),
    ):
        with pytest.raises(CertificateError, match=says or "are no pair that is checked"):
            ask()
    turned = search.find_pair_certificate((int(pair[1]), int(pair[0])), C, d)
    assert turned.clearance == search.find_pair_certificate(pair, C, d).clearance
