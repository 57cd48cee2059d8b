"""Deep overlap through to full containment, against a search over all separating directions."""

from hard_corpus.batches import Case, Complaint, complaints, relative, size, solve
from hard_corpus.bodies import closed_mesh, corners, faces_of, scattered_hull
from hard_corpus.constructed import BODIES, DIRECTIONS, pair_of, random_pose, SIZE
from hard_corpus.sites import best_gap, gaps, pose
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Convex, HalfSpace, Sphere

POLYTOPES = [
    Box(1 / 5, 1 / 6, 1 / 7),
    scattered_hull(SIZE, 12),
    closed_mesh(SIZE, 10),
    Box(1 / 50, 1 / 5, 1 / 9),
]


def _hull(shape):
    return Convex(vertices=corners(shape)) if isinstance(shape, Box) else shape


def _edges(shape):
    points, triangles = corners(_hull(shape)), faces_of(_hull(shape))[0]
    pairs = {tuple(sorted((t[k], t[k - 1]))) for t in triangles for k in range(3)}
    return np.array([points[a] - points[b] for a, b in sorted(pairs)])


def _directions(A, B, R):
    """Return the directions one of which separates best: normals of faces, and across edges.

    A ball has none of its own, a capsule is an edge with a radius: the facets of the difference
    of two polytopes come from a face of either or from an edge of each.
    """
    edges, normals = [], []
    for shape, turn in ((A, np.eye(3)), (B, R)):
        if isinstance(shape, Sphere):
            edges.append(np.zeros((0, 3)))
        elif isinstance(shape, Capsule):
            edges.append(turn[:, 2:].T)
        else:
            edges.append(_edges(shape) @ turn.T)
            normals.append(faces_of(_hull(shape))[1] @ turn.T)
    across = np.cross(edges[0][:, None], edges[1][None]).reshape(-1, 3)
    length = np.linalg.norm(across, axis=1)
    across = across[length > 1e-12] / length[length > 1e-12][:, None]
    one_way = np.vstack([*normals, across])
    return np.vstack([one_way, -one_way])


def _polytope_cases(count, reach, seed):
    rng = np.random.default_rng(seed)
    bodies = [*POLYTOPES, Capsule(1 / 15, 1 / 15), Sphere(1 / 20)]
    found = []
    while len(found) < count:
        A, B = (bodies[k] for k in rng.integers(0, len(bodies), 2))
        if A not in POLYTOPES and B not in POLYTOPES:
            continue
        X_WA, X_AB = random_pose(rng), random_pose(rng, reach)
        case = Case(f"case {len(found)}", A, B, X_WA, X_WA @ X_AB)
        X_AB = relative(case.X_WA, case.X_WB)
        depth = gaps(A, B, X_AB, _directions(A, B, X_AB[:3, :3])).max()
        # Only a core inside has its way out through a face or across two edges.
        if depth < -max(getattr(A, "radius", 0.0), getattr(B, "radius", 0.0)):
            found.append(case._replace(truth=depth))
    return found


@pytest.mark.parametrize("reach", [0.1, 0.02, 1e-6, 0.0])
def test_depth_of_polytopes_is_the_least_of_all_directions(reach):
    """From shallow to concentric: boxes, hulls, meshes, capsules and balls, to 1e-12 L."""
    assert complaints(_polytope_cases(120, reach, 3)) == []


def test_identical_polytopes_in_one_place():
    """A body and its copy overlap by its least width, which a face or two edges decide."""
    cases = []
    for shape in POLYTOPES:
        X_W = random_pose(np.random.default_rng(5))
        depth = gaps(shape, shape, np.eye(4), _directions(shape, shape, np.eye(3))).max()
        cases.append(Case("identical", shape, shape, X_W, X_W, depth))
    assert complaints(cases) == []


@pytest.mark.parametrize(
    ("name", "width"),
    [
        ("sphere", 2 / 10),
        ("capsule", 2 / 15),
        ("box", 1 / 7),
        ("cylinder", 2 / 11),
        ("ellipsoid", 2 / 15),
    ],
)
def test_identical_primitives_in_one_place(name, width):
    """A body and its copy overlap by its least width."""
    shape = BODIES[name][0]
    for k in range(5):
        X_W = random_pose(np.random.default_rng(k))
        assert complaints([Case(name, shape, shape, X_W, X_W, -width)]) == []


def _curved_cases(count, seed):
    rng = np.random.default_rng(seed)
    bodies = [body for name, (body, exact) in BODIES.items() if not exact]
    bodies = [body for body in bodies if not isinstance(body, HalfSpace)]
    found = []
    for k in range(count):
        A, B = (bodies[row] for row in rng.integers(0, len(bodies), 2))
        X_WA = random_pose(rng)
        X_AB = random_pose(rng, rng.choice([0.06, 1e-2, 1e-5]))
        found.append(Case(f"case {k}", A, B, X_WA, X_WA @ X_AB))
    return found


def _curved_complaints(seed):
    """Return Complaints, also of depths that one of thousands of directions beats."""
    cases = _curved_cases(400, seed)
    answers = solve(cases)
    found = complaints(cases, answers, directions=DIRECTIONS)
    for k, case in enumerate(cases):
        if answers.distance[k] < 0.0:
            X_AB = relative(case.X_WA, case.X_WB)
            start = np.vstack([DIRECTIONS, case.X_WA[:3, :3].T @ answers.nhat_BA_W[k]])
            best, _ = best_gap(case.A, case.B, X_AB, start)
            if not best <= answers.distance[k] + 1e-12 * size(case):
                excess = (best - answers.distance[k]) / size(case)
                found.append(Complaint(excess, case.label, "depth", answers.distance[k]))
    return found


@pytest.mark.parametrize("seed", [7, 8])
def test_no_direction_separates_better(seed):
    """Deep pairs of all shapes: the normal attains the depth, and none of thousands beats it."""
    assert _curved_complaints(seed) == []


def test_random_overlaps_are_of_all_pairs_of_finite_shapes():
    """28 of the 35 pairs; those with a half space are not searched."""
    assert len({pair_of(case) for case in _curved_cases(400, 7)}) == 28


def test_small_bodies_inside_large_ones():
    """A ball anywhere in a box leaves through the nearest wall, the least of six."""
    rng = np.random.default_rng(9)
    box, half = Box(2.0, 3.0, 4.0), np.array([1.0, 1.5, 2.0])
    for radius in (1e-6, 1e-3, 0.3):
        cases = []
        for k in range(100):
            p = rng.uniform(-1.0, 1.0, 3) * half
            X_WA = random_pose(rng)
            truth = -(np.min(half - abs(p)) + radius)
            ball = Sphere(radius)
            cases.append(Case(f"{radius} {k}", box, ball, X_WA, X_WA @ pose(np.eye(3), p), truth))
        assert complaints(cases) == []
