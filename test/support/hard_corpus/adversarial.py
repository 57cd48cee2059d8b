"""Random and nasty pairs without a known answer, and a text form that keeps them bit for bit."""

import functools
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import (
    Case,
    Complaint,
    complaints,
    EPSILON,
    size,
    solve,
    swapped,
)
from hard_corpus.bodies import closed_mesh, dented_mesh, extent, rescaled, scattered_hull
from hard_corpus.constructed import DIRECTIONS
from hard_corpus.mesh_contacts import one_sidedness, TRIANGLE_MESHES, triangle_sites
from hard_corpus.sites import place, pose, sites_of
from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Sphere,
)
from scene_graph_ros.geometry.tolerances import MIN_SHAPE_SIZE, OSCULATION

__all__ = [
    "KEPT",
    "adversarial_cases",
    "case_from_text",
    "mesh_cases",
    "text_from_case",
    "violations",
]

KEPT = Path(__file__).with_name("counterexamples.jsonl")
"""Pairs that once had a fault, one line each; ``open`` says which, while it is not fixed."""

BOUND = 1e-9
"""Relative to the size of the pair: what DESIGN promises of the hard corpus."""

_CLASSES = {
    "Sphere": (Sphere, ("radius",)),
    "Capsule": (Capsule, ("radius", "length")),
    "Box": (Box, ("width", "depth", "height")),
    "Cylinder": (Cylinder, ("radius", "length")),
    "Ellipsoid": (Ellipsoid, ("a", "b", "c")),
    "HalfSpace": (HalfSpace, ()),
}


def _polytopes():
    """Return hulls and meshes: tetrahedra, cubes as hulls, flat ones, slivers and round ones."""
    rng = np.random.default_rng(17)
    cube = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    points = [
        cube,
        np.vstack([np.zeros(3), 0.2 * np.eye(3)]),
        np.array([[0, 0, 0], [1, 0, 0], [0.3, 1e-4, 0], [0.6, 0, 1e-4]]),
        np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0], [0, 0.1, 0]]),
        np.vstack([cube, cube * [1.0, 1.0, 1.0 + 1e-9]]),
        rng.normal(size=(8, 3)) * [0.1, 0.1, 1e-3],
    ]
    hulls = [Convex(vertices=p) for p in points]
    hulls += [scattered_hull(0.2, count, seed) for count, seed in ((6, 1), (20, 2), (150, 3))]
    return [*hulls, closed_mesh(0.2, 12, 4), closed_mesh(0.05, 40, 5), dented_mesh(0.2, 24)]


_POLYTOPES = _polytopes()
DENTED = _POLYTOPES[-1]
"""Measured by its triangles; the other meshes by their hulls."""
WITHOUT_SITES = (*_POLYTOPES[2:6], DENTED)
"""Whose faces are nearly parallel or nothing but rounding, or not all on the hull."""


def _random_shape(rng):
    kind = rng.integers(0, 8)
    if kind >= 6:
        return _POLYTOPES[rng.integers(0, len(_POLYTOPES))]
    cls, fields = list(_CLASSES.values())[kind]
    style = rng.integers(0, 4)
    if style == 0:  # round numbers, so that faces and axes coincide
        sizes = rng.choice([0.05, 0.1, 0.2, 1 / 3], 3)
    elif style == 1:  # thin ones
        sizes = 10.0 ** rng.uniform(-4.0, 0.0, 3)
    else:
        sizes = rng.uniform(0.02, 0.3, 3)
    return cls(*(float(x) for x in sizes[: len(fields)]))


def _random_rotation(rng):
    style = rng.integers(0, 4)
    if style == 0:
        return np.eye(3)
    if style == 1:  # the symmetries of a cube, exact
        signs = rng.choice([-1.0, 1.0], 3)
        R = np.diag(signs)[rng.permutation(3)]
        return R if np.linalg.det(R) > 0 else -R
    if style == 2:  # nearly aligned
        return _nearly_straight(rng)
    return Rotation.random(rng=rng).as_matrix()


def _random_placement(rng, A, B):
    style = rng.integers(0, 5)
    R = _random_rotation(rng)
    L = max(extent(A), extent(B))
    if style == 0:
        return pose(R, L * rng.uniform(-1.5, 1.5, 3))
    if style == 1:  # round numbers along some axes
        return pose(R, rng.choice([0.0, 0.05, -0.1, 0.15, 0.2, -1 / 3], 3))
    if style <= 3 and _is_solid(A) and _is_solid(B):
        seeds = rng.integers(0, 1000, 2)
        sites_A, sites_B = sites_of(A, seeds[0]), sites_of(B, seeds[1])
        return _facing(rng, sites_A, sites_B, L, style == 3)
    return pose(R, L * rng.normal(size=3) * 10.0 ** rng.uniform(-12, 0))


def _facing(rng, sites_A, sites_B, L, is_turned):
    """Return X_AB with some sites facing each other; ``is_turned``: not exactly."""
    small = -(10.0 ** rng.uniform(-16, -1))
    gap = L * rng.choice([0.0, *(10.0 ** rng.uniform(-16, -1, 2)), small])
    near = 10.0 ** rng.uniform(-15, -3)
    roll = rng.choice([0.0, np.pi / 2, rng.uniform(0.0, 6.0), near])
    site_A = sites_A[rng.integers(0, len(sites_A))]
    X_AB = place(site_A, sites_B[rng.integers(0, len(sites_B))], gap, roll)
    return X_AB @ pose(_nearly_straight(rng), np.zeros(3)) if is_turned else X_AB


def _nearly_straight(rng):
    turn = 10.0 ** rng.uniform(-16, -2) * rng.normal(size=3)
    return Rotation.from_rotvec(turn).as_matrix()


def _is_solid(shape):
    """Tell whether the shape has contact sites."""
    return shape not in WITHOUT_SITES


def _world_pose(rng):
    style = rng.integers(0, 4)
    if style == 0:
        return np.eye(4)
    reach = 1e6 if style == 1 else 1.0
    return pose(_random_rotation(rng), rng.uniform(-reach, reach, 3))


def adversarial_cases(count, seed):
    """Return cases of any two shapes in positions that algorithms like least."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        A, B = _random_shape(rng), _random_shape(rng)
        if isinstance(A, HalfSpace) and isinstance(B, HalfSpace):
            continue
        if rng.integers(0, 6) == 0:
            B = A if not isinstance(A, HalfSpace) else B
        if rng.integers(0, 4) == 0:  # other sizes, of both or of one
            factors = 10.0 ** rng.choice([rng.uniform(-4.0, 4.0), -4.0, 4.0], 1).repeat(2)
            factors[rng.integers(0, 2)] *= rng.choice([1.0, 1.0, 1e-6, 1e-3])
            A, B = (_resized(s, f) for s, f in zip((A, B), factors, strict=True))
        X_WA = _world_pose(rng)
        X_WB = X_WA @ _random_placement(rng, A, B)
        triangles = (A is DENTED, B is DENTED)
        label = f"seed {seed} case {len(found)}"
        found.append(Case(label, A, B, X_WA, X_WB, np.nan, triangles))
    return found


def mesh_cases(count, seed):
    """Return cases with meshes measured by their triangles, most of them next to contact."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        k = rng.integers(0, len(TRIANGLE_MESHES), 2)
        factors = _sizes(rng)
        A, other = (_grown(TRIANGLE_MESHES[k[i]], factors[i]) for i in (0, 1))
        both = bool(rng.integers(0, 4) == 0)
        B = other if both else _random_shape(rng)
        X_WA = _world_pose(rng)
        style = rng.integers(0, 4)
        if B in WITHOUT_SITES:
            style = 3
        if not both:
            B = (_grown if isinstance(B, Mesh | Convex) else _resized)(B, factors[1])
        L = max(extent(A), extent(B))
        if style == 3:
            reach = rng.choice([1.0, 0.5, 10.0 ** rng.uniform(-12, 0)])
            X_AB = pose(_random_rotation(rng), L * reach * rng.normal(size=3))
        else:
            sites = triangle_sites(B, rng) if both else sites_of(B, rng.integers(0, 1000))
            X_AB = _facing(rng, triangle_sites(A, rng), sites, L, style == 2)
        case = Case(f"meshes {seed} case {len(found)}", A, B, X_WA, X_WA @ X_AB)
        case = case._replace(triangles=(True, both))
        found += swapped([case]) if rng.integers(0, 2) else [case]
    return found


_grown = functools.cache(rescaled)


def _sizes(rng):
    """Return two factors of sizes: usually 1; else one is up to a million times the other."""
    factors = rng.choice([1.0, 1.0, 1e3, 0.1], 1).repeat(2)
    factors[rng.integers(0, 2)] *= rng.choice([1.0, 1.0, 1.0, 1e-6, 1e-3])
    return factors


def _resized(shape, factor):
    """Return a primitive grown, but none too small to be a shape; hulls and meshes stay."""
    if isinstance(shape, Convex | Mesh | HalfSpace):
        return shape
    smallest = min(getattr(shape, field) for field in _CLASSES[shape.type_name][1])
    return rescaled(shape, max(float(factor), 2.0 * MIN_SHAPE_SIZE / smallest))


def violations(cases):
    """Return Complaints of all that is wrong with the answers for the cases, worst first.

    Besides what ``complaints`` finds: an exception or nan, a distance that depends on the order
    (``swapped``) or changes by more than B is moved (``steep``), and a certificate below zero.
    """
    answers = solve(cases)
    found = complaints(cases, answers, bound=BOUND, directions=DIRECTIONS[:60])
    rows = {case.label: k for k, case in enumerate(cases)}
    found = [c for c in found if not _is_no_rule(c, cases, answers, rows[c.label])]
    found += [c for k, case in enumerate(cases) for c in _beyond(case, answers, k)]
    other = solve(swapped(cases)).distance
    moved = [_moved(case) for case in cases]
    near = solve(moved).distance
    for k, (case, beside) in enumerate(zip(cases, moved, strict=True)):
        L = size(case)
        phi = answers.distance[k]
        if any(case.triangles) and min(phi, near[k]) < BOUND * L:
            continue  # docs/meshes.md: a local rule, and an estimate for two meshes
        step = np.linalg.norm(beside.X_WB[:3, 3] - case.X_WB[:3, 3])
        far = max(np.linalg.norm(X[:3, 3]) for X in (case.X_WA, case.X_WB))
        excesses = {"swapped": abs(other[k] - phi), "steep": abs(near[k] - phi) - step}
        found += [
            Complaint(excess / L, case.label, name, case.truth)
            for name, excess in excesses.items()
            if not excess <= BOUND * L + 1e-15 * far
        ]
    for case, gap in zip(cases, answers.gap, strict=True):
        if not gap >= -16.0 * EPSILON * size(case):
            found.append(Complaint(abs(gap) / size(case), case.label, "certificate", np.nan))
    return sorted(found, reverse=True)


def _moved(case):
    """Return the case with B moved by 1e-9 m in a direction that its label decides."""
    X_WB = case.X_WB.copy()
    X_WB[:3, 3] += 1e-9 * DIRECTIONS[int(case.label.split()[-1]) % len(DIRECTIONS)]
    return case._replace(X_WB=X_WB)


def _is_no_rule(complaint, cases, answers, k):
    """Tell whether the complaint is about something that does not hold for triangles.

    No direction needs to separate what is not convex as a whole, and where it is cut the witness
    is beside the face that is left across.
    """
    case = cases[k]
    if complaint.quantity.startswith("off"):
        return case.triangles["AB".index(complaint.quantity[-1])] and _is_cut(case, answers, k)
    return any(case.triangles) and complaint.quantity == "tight"


def _beyond(case, answers, k):
    """Return Complaints of bodies that reach beyond the planes through their witnesses.

    Next to the triangles of a mesh nothing is known of that where the bodies overlap.
    """
    if not any(case.triangles):
        return []
    L = size(case)
    reach = one_sidedness(case, answers, k)
    bound = BOUND * L + 16.0 * EPSILON * np.linalg.norm(case.X_WB[:3, 3] - case.X_WA[:3, 3])
    return [
        Complaint(reach[side] / L, case.label, f"beyond {'AB'[side]}", case.truth)
        for side in (0, 1)
        if not (reach[side] <= bound or (case.triangles[side] and _is_cut(case, answers, k)))
    ]


def _is_cut(case, answers, k):
    """Tell whether a pair with a mesh overlaps so that its rule, not a contact, has the answer."""
    return answers.distance[k] < -OSCULATION * size(case)


def _text_from_shape(shape):
    if isinstance(shape, Convex | Mesh):
        rows = [[float(x).hex() for x in row] for row in np.asarray(shape.vertices)]
        faces = np.asarray(shape.faces).tolist() if isinstance(shape, Mesh) else None
        return {"kind": shape.type_name, "vertices": rows, "faces": faces}
    fields = _CLASSES[shape.type_name][1]
    return {"kind": shape.type_name, "sizes": [getattr(shape, f).hex() for f in fields]}


def _shape_from_text(text):
    if text["kind"] in _CLASSES:
        return _CLASSES[text["kind"]][0](*map(float.fromhex, text["sizes"]))
    vertices = np.array([[float.fromhex(x) for x in row] for row in text["vertices"]])
    if text["kind"] == "Convex":
        return Convex(vertices=vertices)
    return Mesh(vertices=vertices, faces=np.array(text["faces"]))


def text_from_case(case):
    """Return the case as JSON-ready text, every number exact."""
    poses = {
        name: [float(x).hex() for x in getattr(case, name)[:3].ravel()]
        for name in ("X_WA", "X_WB")
    }
    shapes = {"A": _text_from_shape(case.A), "B": _text_from_shape(case.B)}
    return {"label": case.label, **shapes, **poses, "triangles": list(case.triangles)}


def case_from_text(text):
    """Return the case that was written."""
    poses = []
    for name in ("X_WA", "X_WB"):
        X = np.eye(4)
        X[:3] = np.reshape([float.fromhex(x) for x in text[name]], (3, 4))
        poses.append(X)
    shapes = (_shape_from_text(text[name]) for name in "AB")
    return Case(text["label"], *shapes, *poses, np.nan, tuple(text["triangles"]))
