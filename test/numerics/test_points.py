"""Points against every shape: distance, nearest point and gradient by construction."""

from hard_corpus.bodies import corners, extent, faces_of, support
from hard_corpus.constructed import BODIES, DIRECTIONS, grown, random_pose, SIZE
from hard_corpus.extremes import THIN
from hard_corpus.sites import frame, sites_of
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, HalfSpace, Mesh
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

BELOW = ("face", "side", "smooth", "tip", "flat", "cap", "seam", "apex")
"""Features that are flat or round, so that the way out from just below is the normal."""


def asked(shape, X_WG, p_WQs):
    """Return (phi, p_GN, grad_W, unique) of one shape."""
    table = build_shape_table([shape], [isinstance(shape, Mesh)])
    poses = np.ascontiguousarray(X_WG[None])
    _, _, *columns = distance_points(table, poses, np.ascontiguousarray(p_WQs), np.inf)
    return columns


def is_way_out(shape, site, depth, margin):
    """Tell whether a ball of radius ``depth`` below the site touches the surface only there.

    Where it is round, its radii have to be ``margin`` times the depth.
    """
    if site.feature not in BELOW:
        return False
    if isinstance(shape, HalfSpace):
        return True
    q = site.point - depth * site.normal
    if isinstance(shape, Box | Convex | Mesh):
        normals = np.vstack([np.eye(3), -np.eye(3)]) if isinstance(shape, Box) else None
        normals = faces_of(shape)[1] if normals is None else normals
        heights = (normals @ corners(shape).T).max(axis=1) - normals @ q
        return heights.min() >= depth * (1.0 - 1e-9)
    basis = frame(site)[:, :2]
    if np.linalg.eigvalsh(basis.T @ site.bend @ basis)[0] <= margin * depth:
        return False
    return (support(shape, DIRECTIONS) - DIRECTIONS @ q).min() >= depth


def worst_of(bodies, distance, X_WG, *, slack=0.0, scale=1.0, margin=1.5):
    """Return {quantity: (error / L, where)} over all sites of the bodies."""
    worst = {}
    for name, (shape, _) in bodies.items():
        size = SIZE * scale if isinstance(shape, HalfSpace) else extent(shape)
        sites = [
            site
            for seed in range(5)
            for site in sites_of(shape, seed, size)
            if distance >= 0.0
            or (site.feature in BELOW and is_way_out(shape, site, -distance, margin))
        ]
        if not sites:
            continue
        points = np.array([site.point + distance * site.normal for site in sites])
        phi, p_GN, grad_W, _ = asked(shape, X_WG, points @ X_WG[:3, :3].T + X_WG[:3, 3])
        grad_G = grad_W @ X_WG[:3, :3]
        normals = np.array([site.normal for site in sites])
        errors = {
            "unit": abs(np.linalg.norm(grad_W, axis=1) - 1.0),
            "distance": (abs(phi - distance) - slack) / size,
            "identity": (np.abs(points - p_GN - phi[:, None] * grad_G).max(axis=1) - slack) / size,
        }
        if abs(distance) > 1e-3 * size:
            nearest = np.array([site.point for site in sites])
            errors["gradient"] = np.abs(grad_G - normals).max(axis=1) - slack / abs(distance)
            errors["nearest"] = (np.abs(p_GN - nearest).max(axis=1) - 2 * slack) / size
        for quantity, error in errors.items():
            k = error.argmax()
            row = (float(error[k]), f"{name} {sites[k].feature}")
            worst[quantity] = max(worst.get(quantity, (-np.inf, "")), row)
    return worst


def exceeding(worst, bound):
    """Return what is over the bound; normals are known to 1e-11 at a thousandth of the size."""
    bounds = {"unit": 1e-12, "gradient": max(1e-11, bound)}
    return {q: row for q, row in worst.items() if not row[0] <= bounds.get(q, bound)}


@pytest.mark.parametrize("distance", [0.5, 2e-3, 1e-6, 1e-12, 0.0, -1e-12, -1e-6, -2e-3, -1e-2])
def test_points_over_and_under_every_feature(distance):
    """Distance, gradient and nearest point are those constructed, to 1e-12 L."""
    X_WG = random_pose(np.random.default_rng(1))
    assert exceeding(worst_of(BODIES, distance, X_WG), 1e-12) == {}


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1e2, 1e4])
def test_points_at_every_scale(scale):
    """The same holds at sizes from 20 micrometres to 2 kilometres."""
    for part in (0.5, 0.01, 0.0, -0.01):
        X_WG = random_pose(np.random.default_rng(2), scale)
        worst = worst_of(grown(BODIES, scale), part * SIZE * scale, X_WG, scale=scale)
        assert exceeding(worst, 1e-12) == {}, part


@pytest.mark.parametrize("distance", [1e-2, 1e-6, 0.0, -1e-6, -1e-5])
def test_points_at_needles_plates_and_blades(distance):
    """Aspects of 1 : 10000, ellipsoids of 1 : 1000."""
    X_WG = random_pose(np.random.default_rng(3))
    assert exceeding(worst_of(THIN, distance, X_WG, margin=10.0), 1e-9) == {}


@pytest.mark.parametrize("distance", [2e-3, -2e-3])
def test_points_a_thousand_kilometres_away(distance):
    """Positions of 1e6 m are rounded by 0.6e-10 m per axis and body; the answer by no more."""
    X_WG = random_pose(np.random.default_rng(4), 1e6)
    assert exceeding(worst_of(BODIES, distance, X_WG, slack=2.4e-10), 1e-12) == {}


@pytest.mark.parametrize(
    ("name", "depth"),
    [
        ("sphere", 1 / 10),
        ("capsule", 1 / 15),
        ("box", 0.5 * (1 / 7)),
        ("cylinder", 1 / 11),
        ("ellipsoid", 1 / 15),
    ],
)
def test_the_middle_is_as_deep_as_half_the_least_width(name, depth):
    """In the centre the depth is the inradius; the nearest point is a choice, and flagged."""
    phi, p_GN, grad_W, unique = asked(BODIES[name][0], np.eye(4), np.zeros((1, 3)))
    assert phi[0] == pytest.approx(-depth, abs=1e-15)
    assert not unique[0]
    assert np.linalg.norm(grad_W[0]) == pytest.approx(1.0, abs=1e-15)
    assert np.abs(p_GN[0] - depth * grad_W[0]).max() <= 1e-15
