"""All queries of the public API tell the same story about the same scene."""

from hard_corpus.batches import Complaint
from hard_corpus.constructed import BODIES, constructed, pair_of, random_pose, SIZE
from hard_corpus.scenes import scene_of, spread
import numpy as np
import pytest

CONVEX = {name: body for name, body in BODIES.items() if "triangles" not in name}


@pytest.mark.parametrize("distance", [2e-3, 1e-9, -1e-9, -2e-3])
def test_penetration_distance_and_candidates_agree(distance):
    """A pair penetrates exactly if its distance is negative, with that depth and that normal."""
    cases = spread(constructed(distance, bodies=CONVEX, rolls=(0.7,)))
    query, ids = scene_of(cases)
    deep = {(p.id_A, p.id_B): p for p in query.compute_point_pair_penetration()}
    near = query.compute_signed_distance_pairwise_closest_points(max_distance=0.01)
    near = {(p.id_A, p.id_B): p for p in near}
    candidates = {(p.id_A, p.id_B) for p in query.find_collision_candidates()}
    assert set(near) == {tuple(pair) for pair in ids}
    assert set(deep) == (set(near) if distance < 0.0 else set())
    assert set(deep) <= candidates
    assert query.has_collisions() == (distance < 0.0)
    for key, pair in near.items():
        # 1 km from the origin positions are rounded by 1e-13.
        assert pair.distance == pytest.approx(distance, abs=1e-12)
        if key in deep:
            other = deep[key]
            assert other.depth == -pair.distance
            assert np.array_equal(other.nhat_BA_W, pair.nhat_BA_W)
            X_WA, X_WB = query.get_pose_in_world(key[0]), query.get_pose_in_world(key[1])
            p_WCa = X_WA[:3, :3] @ pair.p_ACa + X_WA[:3, 3]
            p_WCb = X_WB[:3, :3] @ pair.p_BCb + X_WB[:3, 3]
            assert np.abs(other.p_WCa - p_WCa).max() <= 1e-12
            assert np.abs(other.p_WCb - p_WCb).max() <= 1e-12
            assert (p_WCb - p_WCa) @ other.nhat_BA_W == pytest.approx(other.depth, abs=1e-12)


def test_one_pair_asked_alone_or_among_all():
    """The query of one pair gives what the query of all pairs gives, bit for bit."""
    rng = np.random.default_rng(1)
    cases = [
        case._replace(X_WA=random_pose(rng, 0.15), X_WB=random_pose(rng, 0.15))
        for case in constructed(0.0, bodies=CONVEX, rolls=(0.7,))[::60]
    ]
    cases = spread(cases)[:12]
    cases = [
        case._replace(X_WA=random_pose(rng, 0.3), X_WB=random_pose(rng, 0.3)) for case in cases
    ]
    query, _ = scene_of(cases)
    table = query.compute_signed_distance_pairwise_closest_points()
    assert len(table) == 12 * 23
    deep = {(p.id_A, p.id_B): p.depth for p in query.compute_point_pair_penetration()}
    assert deep
    assert {key: -depth for key, depth in deep.items()} == {
        (p.id_A, p.id_B): p.distance for p in table if p.distance < 0.0
    }
    for pair in table:
        alone = query.compute_signed_distance_pair_closest_points(pair.id_B, pair.id_A)
        assert alone.distance == pair.distance
        assert np.array_equal(alone.p_ACa, pair.p_ACa)
        assert np.array_equal(alone.nhat_BA_W, pair.nhat_BA_W)


def test_limits_keep_exactly_the_pairs_within():
    """A max_distance keeps the pairs of the unlimited answer up to it, also a negative one."""
    rng = np.random.default_rng(2)
    cases = spread(constructed(0.0, bodies=CONVEX, rolls=(0.7,))[::90])[:12]
    cases = [
        case._replace(X_WA=random_pose(rng, 0.3), X_WB=random_pose(rng, 0.3)) for case in cases
    ]
    query, _ = scene_of(cases)
    everything = query.compute_signed_distance_pairwise_closest_points()
    for limit in (-0.02, 0.0, 0.05, 0.2):
        table = query.compute_signed_distance_pairwise_closest_points(max_distance=limit)
        kept = [(p.id_A, p.id_B, p.distance) for p in everything if p.distance <= limit]
        found = [(p.id_A, p.id_B, p.distance) for p in table]
        assert [row[:2] for row in found] == [row[:2] for row in kept]
        error = [abs(a[2] - b[2]) for a, b in zip(found, kept, strict=True)]
        assert max(error) <= 1e-12 * SIZE


def _witnesses():
    """Return Complaints of witnesses that the point query does not find on both surfaces."""
    cases = spread(constructed(2e-3, bodies=CONVEX, rolls=(0.7,)))
    query, ids = scene_of(cases)
    near = query.compute_signed_distance_pairwise_closest_points(max_distance=0.01)
    assert [(pair.id_A, pair.id_B) for pair in near] == [tuple(pair) for pair in ids]
    points, expected = [], []
    for pair in near:
        X_WA, X_WB = query.get_pose_in_world(pair.id_A), query.get_pose_in_world(pair.id_B)
        p_WCa = X_WA[:3, :3] @ pair.p_ACa + X_WA[:3, 3]
        p_WCb = X_WB[:3, :3] @ pair.p_BCb + X_WB[:3, 3]
        points += [p_WCa, p_WCb]
        expected += [{int(pair.id_A): 0.0, int(pair.id_B): pair.distance}]
        expected += [{int(pair.id_A): pair.distance, int(pair.id_B): 0.0}]
    table = query.compute_signed_distance_to_points(np.array(points), threshold=0.01)
    found = [{} for _ in points]
    for row, geometry, phi in zip(table.point, table.id_G, table.distance, strict=True):
        found[row][int(geometry)] = phi
    worst = []
    for k, (one, other) in enumerate(zip(found, expected, strict=True)):
        error = max(abs(one[geometry] - phi) for geometry, phi in other.items())
        # Up to 1 km from the origin positions are rounded by 1e-13.
        if not error <= 1e-12:
            worst.append(Complaint(error / SIZE, cases[k // 2].label, "witness", 2e-3))
    return worst


def test_witness_points_are_at_distance_zero():
    """The point query finds the witness points on their own surfaces, and phi beyond the other.

    The latter for pairs apart: the nearest point of B to a nearest point of A is that far.
    """
    assert _witnesses() == []


def test_all_pairs_but_one_have_an_answer():
    """The corpus covers the 35 pairs."""
    assert len({pair_of(case) for case in constructed(0.0, bodies=CONVEX, rolls=(0.7,))}) == 35
