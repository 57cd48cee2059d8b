"""Random and nasty pairs without a known answer, and a text form that keeps them bit for bit."""

import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import Case, complaints, solve
from hard_corpus.bodies import closed_mesh, scattered_hull
from hard_corpus.constructed import DIRECTIONS
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

__all__ = ["adversarial_cases", "case_from_text", "text_from_case", "violations"]

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
    return [*hulls, closed_mesh(0.2, 12, 4), closed_mesh(0.05, 40, 5)]


_POLYTOPES = _polytopes()


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
        return Rotation.from_rotvec(10.0 ** rng.uniform(-16, -2) * rng.normal(size=3)).as_matrix()
    return Rotation.random(rng=rng).as_matrix()


def _random_placement(rng, A, B):
    style = rng.integers(0, 4)
    R = _random_rotation(rng)
    if style == 0:
        return pose(R, rng.uniform(-0.3, 0.3, 3))
    if style == 1:  # round numbers along some axes
        return pose(R, rng.choice([0.0, 0.05, -0.1, 0.15, 0.2, -1 / 3], 3))
    if style == 2 and not (isinstance(A, HalfSpace) and isinstance(B, HalfSpace)):
        seeds = rng.integers(0, 1000, 2)
        sites_A = sites_of(A, seeds[0]) if _is_solid(A) else None
        sites_B = sites_of(B, seeds[1]) if _is_solid(B) else None
        if sites_A and sites_B:
            gap = rng.choice(
                [0.0, *(10.0 ** rng.uniform(-16, -1, 2)), -(10.0 ** rng.uniform(-16, -1))]
            )
            roll = rng.choice(
                [0.0, np.pi / 2, rng.uniform(0.0, 6.0), 10.0 ** rng.uniform(-15, -3)]
            )
            site_A = sites_A[rng.integers(0, len(sites_A))]
            return place(site_A, sites_B[rng.integers(0, len(sites_B))], gap, roll)
    return pose(R, rng.normal(size=3) * 10.0 ** rng.uniform(-12, 0))


def _is_solid(shape):
    return not isinstance(shape, Convex | Mesh) or shape not in (_POLYTOPES[2:6])


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
        X_AB = _random_placement(rng, A, B)
        X_WA = np.eye(4)
        if rng.integers(0, 2):
            X_WA = pose(_random_rotation(rng), rng.uniform(-1.0, 1.0, 3))
        found.append(Case(f"seed {seed} case {len(found)}", A, B, X_WA, X_WA @ X_AB))
    return found


def violations(cases):
    """Return what is wrong with the answers for the cases, worst first."""
    return complaints(cases, solve(cases), bound=BOUND, directions=DIRECTIONS[:60])


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
    return {"label": case.label, **shapes, **poses}


def case_from_text(text):
    """Return the case that was written."""
    poses = []
    for name in ("X_WA", "X_WB"):
        X = np.eye(4)
        X[:3] = np.reshape([float.fromhex(x) for x in text[name]], (3, 4))
        poses.append(X)
    return Case(text["label"], _shape_from_text(text["A"]), _shape_from_text(text["B"]), *poses)
