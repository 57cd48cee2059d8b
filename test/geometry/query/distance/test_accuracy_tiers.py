"""Looser tiers keep their promise, and the certificate bounds what is really wrong."""

import itertools

from convex_bodies import align, pose, rounded_hull, sites, tetrahedron_mesh
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.geometry.accuracy import Accuracy
from scene_graph_ros.geometry.query.distance.driver import PENETRATIONS, solve_pairs, WITHIN
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

BODIES = {
    "sphere": Sphere(1 / 9),
    "capsule": Capsule(1 / 15, 0.2),
    "box": Box(0.2, 1 / 6, 0.12),
    "cylinder": Cylinder(1 / 11, 0.2),
    "ellipsoid": Ellipsoid(0.1, 0.08, 1 / 15),
    "half space": HalfSpace(),
    "convex": rounded_hull(0.2, 40),
    "mesh": tetrahedron_mesh(0.2),
}
PAIRS = list(itertools.combinations_with_replacement(BODIES, 2))
PAIRS.remove(("half space", "half space"))
LOOSE = [Accuracy.QUICK, Accuracy.STANDARD]
ROUND = {"smooth", "side", "face"}


def constructed(name_A, name_B, exact_B=False):
    """Return (table, X_WG, pairs, truths) of pairs at distances that are constructed."""
    rng = np.random.default_rng(5)
    A, B = BODIES[name_A], BODIES[name_B]
    poses_A, poses_B, truths = [], [], []
    for site_A, site_B in itertools.product(sites(A, rng), sites(B, rng)):
        for truth in (0.1, 2e-3, 1e-6, -1e-6, -2e-3):
            if truth > 0.0 or {site_A.feature, site_B.feature} & ROUND:
                X_WA = pose(Rotation.random(random_state=rng), rng.uniform(-1.0, 1.0, 3))
                poses_A.append(X_WA)
                poses_B.append(X_WA @ align(site_A, site_B, truth, rng.uniform(0.3, 1.2)))
                truths.append(truth)
    n = len(truths)
    table = build_shape_table([A] * n + [B] * n, [False] * n + [exact_B] * n)
    pairs = np.stack([np.arange(n), np.arange(n, 2 * n)], axis=1)
    return table, np.ascontiguousarray(poses_A + poses_B), pairs, np.array(truths)


@pytest.mark.parametrize("tier", LOOSE)
@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_error_is_within_the_promise(name_A, name_B, tier):
    """Distance within the bound and its certificate, the sign right, the identity to rounding."""
    table, X_WG, pairs, truths = constructed(name_A, name_B)
    solved = solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN, tier.bound, True)
    phi, nhat, gap = solved.distance, solved.nhat_BA_W, solved.gap
    size = max(table.scale)
    assert np.abs(phi - truths).max() <= tier.bound * size
    assert np.array_equal(np.sign(phi), np.sign(truths))
    assert (np.abs(phi - truths) <= gap + 1e-14).all()
    assert np.allclose(solved.p_WCa - solved.p_WCb, phi[:, None] * nhat, rtol=0.0, atol=2e-15)
    assert np.allclose(np.linalg.norm(nhat, axis=1), 1.0, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(("name_A", "name_B"), PAIRS)
def test_exact_answers_prove_themselves(name_A, name_B):
    """At the exact tier, the certificate of a pair that is apart is at rounding."""
    table, X_WG, pairs, truths = constructed(name_A, name_B)
    solved = solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN, certify=True)
    phi, gap = solved.distance, solved.gap
    # Poses in the world are rounded at 1 m, for shapes of 0.2 m.
    assert gap[truths > 0.0].max() <= 1e-14
    assert np.abs(phi - truths).max() <= 1e-14


@pytest.mark.parametrize("tier", LOOSE)
def test_penetrating_pairs_are_the_same_at_every_tier(tier):
    """Which pairs penetrate does not depend on the tier, only how deep they are said to be."""
    for name_A, name_B in PAIRS:
        table, X_WG, pairs, truths = constructed(name_A, name_B)
        rows = solve_pairs(hold(table), X_WG, pairs, 0.0, PENETRATIONS, tier.bound).rows
        assert np.array_equal(rows[:, 0], np.flatnonzero(truths < 0.0))


@pytest.mark.parametrize("name_A", [name for name in BODIES if name != "mesh"])
def test_triangles_apart_keep_the_promise(name_A):
    """Against a mesh measured by its triangles the tiers hold as well."""
    table, X_WG, pairs, truths = constructed(name_A, "mesh", exact_B=True)
    apart = truths > 0.0
    for tier in LOOSE:
        solved = solve_pairs(hold(table), X_WG, pairs[apart], np.inf, WITHIN, tier.bound)
        assert np.abs(solved.distance - truths[apart]).max() <= tier.bound * max(table.scale)


@pytest.mark.parametrize("pair", [("cylinder", "ellipsoid"), ("box", "cylinder")])
def test_what_is_soon_proven_is_exact_at_every_tier(pair):
    """Where an exact answer takes no longer than a loose one, all tiers give that."""
    table, X_WG, pairs, truths = constructed(*pair)
    for tier in LOOSE:
        solved = solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN, tier.bound)
        is_exact = np.abs(solved.distance - truths) <= 1e-12 * max(table.scale)
        assert is_exact.mean() > 0.9


@pytest.mark.parametrize("pair", [("cylinder", "convex"), ("ellipsoid", "convex")])
def test_a_looser_tier_stops_earlier(pair):
    """Iterations really end at the gap that is asked for: the certificate shows it is used."""
    table, X_WG, pairs, _ = constructed(*pair)
    gaps = [
        solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN, tier.bound, True).gap.max()
        for tier in (Accuracy.QUICK, Accuracy.STANDARD)
    ]
    size = max(table.scale)
    assert 1e-5 * size < gaps[0] <= Accuracy.QUICK.bound * size
    assert 1e-9 * size < gaps[1] <= Accuracy.STANDARD.bound * size


def test_certificate_exposes_a_wrong_answer():
    """A distance, a normal or a witness that is off by 1e-6 m shows in the gap."""
    from scene_graph_ros.geometry.query.distance.certificate import certify_pairs

    table, X_WG, pairs, truths = constructed("cylinder", "ellipsoid")
    solved = solve_pairs(hold(table), X_WG, pairs, np.inf, WITHIN)
    rows, phi, nhat = solved.rows, solved.distance, solved.nhat_BA_W
    p_ACa, p_BCb = solved.p_ACa, solved.p_BCb
    deep = truths < 0.0
    for k, wrong in ((1, p_ACa + 1e-6), (2, p_BCb - 1e-6), (3, nhat + np.array([1e-3, 0.0, 0.0]))):
        arguments = [p_ACa, p_BCb, nhat]
        arguments[k - 1] = wrong
        gap = np.zeros(len(phi))
        certify_pairs(table, X_WG, rows, phi, *arguments, gap)
        assert gap[~deep].min() > 1e-9
