"""Hulls of awkward points: duplicate, collinear, coplanar, nearly coplanar, thin, and many."""

from hard_corpus.batches import Case, Complaint, complaints, relative, solve
from hard_corpus.bodies import corners, scattered_hull
from hard_corpus.constructed import BODIES, constructed, DIRECTIONS, random_pose, SIZE
from hard_corpus.sites import place, sites_of
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex

OTHERS = {name: body for name, body in BODIES.items() if "triangles" not in name}
BOX = Box(1 / 5, 1 / 6, 1 / 7)


def crowded_box(noise, seed=3):
    """Return a hull of a box's corners, of points on its edges, faces and inside, with noise."""
    rng = np.random.default_rng(seed)
    points = corners(BOX)
    faces = [
        points[points[:, axis] == side * points[:, axis].max()]
        for axis in range(3)
        for side in (1, -1)
    ]
    on_faces = np.vstack([rng.dirichlet(np.ones(4), 12) @ face for face in faces])
    a, b = rng.integers(0, 8, (2, 60))
    on_edges = points[a] + rng.random((60, 1)) * (points[b] - points[a])
    crowd = np.vstack([points, points, on_faces, on_edges, points])
    moved = crowd + noise * rng.uniform(-1.0, 1.0, crowd.shape)
    return Convex(vertices=rng.permutation(np.vstack([points, moved])))


def box_cases(distance, seed=1):
    """Return constructed contacts of the box, to be answered by hulls that are that box."""
    box = {"box": (BOX, False)}
    cases = constructed(distance, bodies=box, others=OTHERS, seed=seed)
    return cases + constructed(distance, bodies=OTHERS, others=box, seed=seed)


@pytest.mark.parametrize("distance", [2e-3, 0.0, -2e-3])
def test_redundant_points_change_nothing(distance):
    """A box given as a hull with duplicate, collinear and coplanar points answers like the box."""
    crowded = crowded_box(0.0)
    cases = [
        case._replace(**{side: crowded for side in "AB" if getattr(case, side) is BOX})
        for case in box_cases(distance)
    ]
    answers = solve(cases)
    assert np.abs(answers.distance - distance).max() <= 1e-12 * SIZE
    # The witnesses are judged by the plain box.
    plain = [
        case._replace(**{side: BOX for side in "AB" if getattr(case, side) is crowded})
        for case in cases
    ]
    assert complaints(plain, answers) == []


@pytest.mark.parametrize("noise", [1e-16, 1e-15, 1e-13, 1e-11, 1e-9, 1e-6])
def test_points_that_are_nearly_coplanar(noise):
    """Noise on the redundant points moves the distance by no more than itself."""
    crowded = crowded_box(noise)
    found = []
    # What rounding decides depends on the poses.
    for distance, seed in [(-2e-3, 1), *((2e-3, seed) for seed in range(1, 17))]:
        cases = [
            case._replace(**{side: crowded for side in "AB" if getattr(case, side) is BOX})
            for case in box_cases(distance, seed)
        ]
        error = np.abs(solve(cases).distance - distance) - np.sqrt(3.0) * noise
        found += [
            Complaint(e / SIZE, case.label, "distance", distance)
            for case, e in zip(cases, error, strict=True)
            if not e <= 1e-12 * SIZE
        ]
    assert found == []


def test_slivers():
    """Tetrahedra with heights of 1e-3 to 1e-12 of their length: apart, the distance is proven."""
    for height in 10.0 ** -np.arange(3.0, 13.0):
        points = np.array([[0, 0, 0], [0.2, 0, 0], [0.06, 0.15, 0], [0.1, 0.05, height * 0.2]])
        bodies = {"sliver": (Convex(vertices=points), False)}
        site = sites_of(BOX)[2]
        corner = np.array([0.0, 0.0, 0.0])
        cases = []
        for name, (B, _) in OTHERS.items():
            for site_B in sites_of(B, 1):
                for k, corner in enumerate(points[:3]):
                    n = (corner - points[:3].mean(axis=0)) / np.linalg.norm(
                        corner - points[:3].mean(axis=0)
                    )
                    tip = site._replace(point=corner, normal=n, tangent=np.array([0.0, 0.0, 1.0]))
                    for distance in (2e-3, 0.0):
                        X_AB = place(tip, site_B, distance, 0.4)
                        label = f"sliver {height} corner {k} / {name} {site_B.feature}"
                        A = bodies["sliver"][0]
                        cases.append(Case(label, A, B, np.eye(4), X_AB, distance))
        answers = solve(cases)
        truths = np.array([case.truth for case in cases])
        error = np.abs(answers.distance - truths)
        assert error.max() <= 1e-12 * SIZE, cases[error.argmax()].label


@pytest.mark.parametrize("distance", [2e-3, 0.0, -2e-3])
def test_hull_of_5000_corners(distance):
    """A hull of 5000 corners against every shape and against another such hull."""
    large = {"large": (scattered_hull(SIZE, 5000), False)}
    some = {name: body for name, body in {**OTHERS, **large}.items() if name != "mesh"}
    if distance < 0.0:  # a search over all normals of two such hulls takes too long
        some = {name: OTHERS[name] for name in ("sphere", "half_space")}
    cases = constructed(distance, bodies=large, others=some, rolls=(0.7,))
    assert len(cases) > 5
    assert complaints(cases) == []


def test_flat_hulls_have_distances_too():
    """Polygons, segments and points as hulls: constructed contacts at their corners."""
    rng = np.random.default_rng(1)
    flat = [
        Convex(vertices=[[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0], [0, 0.1, 0]]),
        Convex(vertices=[[-0.1, 0, 0], [0.1, 0, 0], [0.05, 0, 0]]),
        Convex(vertices=[[0.05, 0.02, 0.01], [0.05, 0.02, 0.01]]),
    ]
    cases = []
    for A in flat:
        points = np.asarray(A.vertices)
        for d in DIRECTIONS[:12]:
            corner = points[(points @ d).argmax()]
            for name, (B, _) in OTHERS.items():
                for site_B in sites_of(B, 1):
                    tip = site_B._replace(
                        point=corner, normal=d, tangent=np.cross(d, DIRECTIONS[20])
                    )
                    tip = tip._replace(tangent=tip.tangent / np.linalg.norm(tip.tangent))
                    X_WA = random_pose(rng)
                    for distance in (2e-3, 0.0):
                        X_WB = X_WA @ place(tip, site_B, distance, 0.3)
                        label = f"{len(points)} points / {name} {site_B.feature}"
                        cases.append(Case(label, A, B, X_WA, X_WB, distance))
    answers = solve(cases)
    error = np.abs(answers.distance - [case.truth for case in cases])
    assert error.max() <= 1e-12 * SIZE, cases[error.argmax()].label
    for k, case in enumerate(cases):
        X_AB = relative(case.X_WA, case.X_WB)
        n = case.X_WA[:3, :3].T @ answers.nhat_BA_W[k]
        rest = answers.p_ACa[k] - X_AB[:3, :3] @ answers.p_BCb[k] - X_AB[:3, 3]
        assert np.abs(rest - answers.distance[k] * n).max() <= 1e-12 * SIZE, case.label
