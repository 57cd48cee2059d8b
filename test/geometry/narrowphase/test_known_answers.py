"""Pairs with answers by construction: tangent planes aligned, then moved apart or into each other.

Two convex bodies with parallel supporting planes at two points that face each other at a distance
along the normal are exactly that far apart. Pressed into each other by a little they overlap by
exactly that, if the features leave no shorter way out: where one of them is flat or round.
"""

import itertools

from convex_bodies import align, answer_convex, residuals, rounded_hull, sites
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Sphere

BODIES = {
    "sphere": Sphere(1 / 9),
    "capsule": Capsule(1 / 15, 0.2),
    "box": Box(0.2, 1 / 6, 0.12),
    "cylinder": Cylinder(1 / 11, 0.2),
    "ellipsoid": Ellipsoid(0.1, 0.08, 1 / 15),
    "wedge": Convex(
        vertices=np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.15, 0], [0, 0, 0.1], [0.2, 0, 0.1]])
    ),
    "pebble": rounded_hull(0.2, 60),
}
SIZE = 0.2
TOLERANCE = 1e-12 * SIZE
ROUND = {"smooth", "side", "face"}


def cases(distance):
    """Yield aligned pairs of all bodies and features whose answer is the distance."""
    rng = np.random.default_rng(7)
    for (name_A, A), (name_B, B) in itertools.product(BODIES.items(), repeat=2):
        for site_A, site_B in itertools.product(sites(A, rng), sites(B, rng)):
            if distance < 0.0 and not {site_A.feature, site_B.feature} & ROUND:
                continue
            X_AB = align(site_A, site_B, distance, rng.uniform(0.3, 1.2))
            yield f"{name_A} {site_A.feature} {name_B} {site_B.feature}", A, B, X_AB, site_A


@pytest.mark.parametrize("distance", [2e-3, 0.05, 1e-6, 1e-9, 0.0, -1e-9, -2e-3])
def test_distance_between_aligned_features(distance):
    """The signed distance is the constructed one, and the result proves itself."""
    for label, A, B, X_AB, _ in cases(distance):
        result = answer_convex(A, B, X_AB)
        assert result.distance == pytest.approx(distance, abs=TOLERANCE), label
        for name, value in residuals(A, B, X_AB, result).items():
            assert value <= TOLERANCE, (label, name, value)


@pytest.mark.parametrize("distance", [2e-3, -2e-3])
def test_normal_is_the_one_constructed(distance):
    """The normal points out of B into A, against A's own outward normal at the contact."""
    for label, A, B, X_AB, site_A in cases(distance):
        result = answer_convex(A, B, X_AB)
        # Rounding of the poses turns the line between two points 2 mm apart by 1e-13.
        assert np.allclose(result.nhat_BA_A, -site_A.normal, atol=2e-12, rtol=0.0), label
        assert result.unique, label


def test_witness_of_a_corner_is_the_corner():
    """Where a vertex meets anything, the witness point on its body is the vertex."""
    rng = np.random.default_rng(3)
    for A in (BODIES["box"], BODIES["wedge"]):
        vertex = sites(A, rng)[2]
        for B in BODIES.values():
            for site_B in sites(B, rng):
                result = answer_convex(A, B, align(vertex, site_B, 2e-3, 0.4))
                assert np.allclose(result.p_ACa, vertex.point, atol=TOLERANCE, rtol=0.0)


def test_far_pairs_stop_early_with_a_lower_bound():
    """Beyond ``max_distance`` the returned distance is some lower bound above it."""
    for label, A, B, X_AB, _ in cases(0.05):
        assert 0.01 < answer_convex(A, B, X_AB, 0.01).distance <= 0.05 + TOLERANCE, label
