"""Planes that do not move: what they prove is true, and they prove nothing else."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from robot_scenes import ARM, diagram, POSTS

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.sums_of_squares.weighted_squares import (
    Identities,
    minimize_over_squares,
)
from scene_graph_ros.planning import (
    CspaceFreeBox,
    CspaceFreePolytope,
    load_robot_diagram,
    PairFailure,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.certified import pair_search, plane_of_many_points
from scene_graph_ros.planning.certified.constant_plane import constant_plane
from scene_graph_ros.planning.certified.pair_problem import PairProblems
from scene_graph_ros.planning.certified.tangent_region import make_region

BOX = np.concatenate([np.eye(2), -np.eye(2)])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


def planes(arm, width, rows=BOX):
    """Return what a plane that does not move shows of each pair."""
    search = CspaceFreePolytope(arm)
    kinematics = search.rational_forward_kinematics
    region = make_region(kinematics, rows, np.full(len(rows), width))
    problems = PairProblems(kinematics, arm.plan, arm.snapshot.inspector, region)
    return [constant_plane(problems.make(pair)) for pair in range(arm.num_pairs)], region


def least_pair(found):
    """Return the pair that keeps least."""
    return min(found.certificates, key=lambda pair: found.certificates[pair].clearance)


@pytest.mark.parametrize("rows", [BOX, np.vstack([BOX, [[1.0, 1.0]]])])
def test_no_pair_is_nearer_than_is_claimed(arm, rows):
    """In narrow boxes all pairs are proven, with nearly all of the clearance in the middle."""
    found, region = planes(arm, 0.01, rows)
    points = np.random.default_rng(0).uniform(region.lower, region.upper, (200, 2))
    q = 2.0 * np.arctan(points[region.contains(points)])
    least = [arm.calc_robot_clearance(each, 3.0).distances.min() for each in q]
    kept = min(certificate.distance for certificate in found)
    assert all(certificate.verify() for certificate in found)
    assert 0.9 * min(least) < kept <= min(least)
    for certificate in found:
        assert all(v == 0 for row in certificate.plane for v in row[1:])


@pytest.mark.parametrize("place", ["clearance", "plane", "point"])
def test_a_changed_number_is_found(arm, place):
    """Nothing more than what is claimed is shown."""
    for certificate in planes(arm, 0.01)[0]:
        tiny = Fraction(1, 10**6)
        other = replace(certificate, clearance=certificate.clearance + tiny)
        if place == "plane":
            first, *rest = certificate.plane
            other = replace(certificate, plane=((first[0] + tiny, *first[1:]), *rest))
        if place == "point":
            grams = [[[list(row) for row in gram] for gram in each] for each in certificate.grams]
            grams[-1][0][0][0] += tiny
            other = replace(certificate, grams=tuple(grams))
        assert not other.verify()


def test_wide_regions_need_planes_that_move(arm):
    """A box that is proven otherwise is too wide for some pairs, and one with collisions too."""
    found, _ = planes(arm, 0.17)
    assert any(each is None for each in found)
    everything = CspaceFreePolytope(arm)
    assert everything.find_separation_certificate_given_polytope(BOX, np.full(4, 0.17)).is_success
    found, _ = planes(arm, 0.4)
    (pair,) = (
        pair
        for pair, ids in enumerate(everything.geometry_pairs)
        if isinstance(everything.find_pair_certificate(ids, BOX, np.full(4, 0.4)), PairFailure)
        and "ball" in everything.find_pair_certificate(ids, BOX, np.full(4, 0.4)).names
    )
    assert found[pair] is None


def test_the_pairs_that_keep_least_get_the_best_planes(arm, monkeypatch):
    """Where all pairs begin with planes that do not move, the distance is the same in the end."""
    search, d = CspaceFreePolytope(arm), np.full(4, 0.12)
    find = search.find_separation_certificate_given_polytope
    best = find(BOX, d)
    monkeypatch.setattr(pair_search, "_SMALL", 0)
    quick = find(BOX, d, most_clearance=False)
    found = find(BOX, d)
    assert best.verify() and quick.verify() and found.verify()
    assert quick.distance < 0.9 * best.distance
    assert best.distance * 0.999 < found.distance < best.distance * 1.02
    moving = [
        any(v for row in each.plane for v in row[1:]) for each in found.certificates.values()
    ]
    assert any(moving) and not all(moving)


@pytest.mark.parametrize("width", [0.05, 0.15])
def test_a_plane_rests_on_few_points(arm, monkeypatch, width):
    """Chosen points give the plane that all give; the others need no matrices, or are chosen."""
    search, d = CspaceFreePolytope(arm), np.full(4, width)
    best = [search.find_pair_certificate(pair, BOX, d) for pair in search.geometry_pairs]
    monkeypatch.setattr(plane_of_many_points, "_MANY", 0)
    monkeypatch.setattr(plane_of_many_points, "_FIRST", 1)
    found = [search.find_pair_certificate(pair, BOX, d) for pair in search.geometry_pairs]
    for own, other in zip(found, best, strict=True):
        assert own.verify() and own.distance == pytest.approx(other.distance, rel=2e-3)
    orders = [[len(each[0]) for each in own.grams] for own in found]
    assert any(1 in own[:8] and 2 in own[:8] for own in orders)
    wide = [search.find_pair_certificate(pair, BOX, d + 0.2) for pair in search.geometry_pairs]
    assert any(isinstance(each, PairFailure) and each.status == "no_plane" for each in wide)


def test_what_is_too_large_is_refused_with_its_size():
    """The systems of a thousand identities with a thousand monomials are 8 GB."""
    base, shift = np.zeros((1, 1), dtype=np.int64), np.zeros((1, 1), dtype=np.int64)
    numbers = np.broadcast_to(np.zeros(1), (1000, 1000))
    part = Identities(base, shift, 1, numbers, np.broadcast_to(np.zeros(1), (1000, 1000, 1)))
    with pytest.raises(SolverError, match="1000 identities of up to 1000 monomials"):
        minimize_over_squares(np.ones((1, 1)), [part], np.zeros(1), gap=1e-3, least=1e-6)


def test_pairs_of_a_panda_are_proven():
    """Seven joints and a finger: hulls of meshes beside each other, a ball, boxes and a floor."""
    checker = SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))
    q = np.array([-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.02])
    half = np.array([*[0.02] * 7, 0.01])
    search = CspaceFreeBox(checker)
    chosen = set(search.geometry_pairs[::40])
    inspector = checker.snapshot.inspector
    for pair in search.geometry_pairs:
        names = [str(inspector.get_name(each)) for each in pair]
        if names in (["panda_link5_collision_0", "floor"], ["panda_hand_collision_0", "ball"]):
            chosen.add(pair)
    others = [pair for pair in search.geometry_pairs if pair not in chosen]
    found = search.find_separation_certificate_given_box(
        q - half, q + half, others, most_clearance=False
    )
    assert found.is_success and len(found.certificates) == len(chosen) >= 12
    assert found.verify()
    inside = np.random.default_rng(0).uniform(q - half, q + half, (50, 8))
    for each in inside:
        clearance = checker.calc_robot_clearance(each, 2.0)
        for (a, b), distance in zip(clearance.pairs, clearance.distances, strict=True):
            own = found.certificates.get((a, b)) or found.certificates.get((b, a))
            assert own is None or own.distance <= distance + 1e-9
    alone = search.find_pair_certificate(least_pair(found), q - half, q + half)
    assert alone.verify() and alone.distance > 0.9 * found.distance
    pair, certificate = next(iter(found.certificates.items()))
    more = replace(certificate, clearance=certificate.clearance + Fraction(1, 10**6))
    assert not replace(found, certificates={**found.certificates, pair: more}).verify()
