"""Solve many pairs in one call of the distance kernel, and measure what answers get wrong."""

from typing import Any, NamedTuple

import numpy as np

from hard_corpus.bodies import extent, outside
from hard_corpus.sites import gaps, pose
from scene_graph_ros.geometry import HalfSpace
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.solved_pairs import NO_FAILURE
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = [
    "EPSILON",
    "Answers",
    "Case",
    "Complaint",
    "complaints",
    "faults",
    "relative",
    "size",
    "solve",
    "swapped",
]

EPSILON = np.finfo(float).eps


class Case(NamedTuple):
    """A pair with its true distance, nan where only invariants are known.

    The true normal and A's witness, in A, are those that were constructed, if they were.
    """

    label: str
    A: Any
    B: Any
    X_WA: np.ndarray
    X_WB: np.ndarray
    truth: float = np.nan
    triangles: tuple[bool, bool] = (False, False)
    nhat_BA_W: np.ndarray | None = None
    p_ACa: np.ndarray | None = None


class Complaint(NamedTuple):
    """By how many L (for the unit normal: by how much) which quantity of which case is off."""

    excess: float
    label: str
    quantity: str
    truth: float


class Answers(NamedTuple):
    """One row per case; ``p_ACa`` in A, ``p_BCb`` in B. ``decided_by`` is there if certified."""

    distance: np.ndarray
    p_ACa: np.ndarray
    p_BCb: np.ndarray
    p_WCa: np.ndarray
    p_WCb: np.ndarray
    nhat_BA_W: np.ndarray
    unique: np.ndarray
    gap: np.ndarray
    decided_by: np.ndarray


class _Built(NamedTuple):
    """A table, and the rows of shapes and whether their triangles are measured."""

    rows: dict[Any, int]
    table: Any


_last = [_Built({}, None)]
"""The table that was built last: cases are asked again, swapped or moved by a little."""


def _built(keys):
    """Return a table that has these keys, each built once."""
    if not keys <= _last[0].rows.keys():
        rows = {key: row for row, key in enumerate(keys)}
        table = build_shape_table([key[0] for key in rows], [key[1] for key in rows])
        # Convex meshes, too: the builder would rather take their hulls.
        table = table._replace(exact=np.array([key[1] for key in rows]))
        _last[0] = _Built(rows, table)
    return _last[0]


def table_of(cases):
    """Return a shape table with rows 2 k, 2 k + 1 for case k."""
    asked = [
        (shape, exact)
        for case in cases
        for shape, exact in zip((case.A, case.B), case.triangles, strict=True)
    ]
    found, table = _built(dict.fromkeys(asked).keys())
    index = np.array([found[key] for key in asked])
    names = ("kind", "size", "hull", "surface", "exact", "lower", "upper", "scale")
    return table._replace(
        **{name: np.ascontiguousarray(getattr(table, name)[index]) for name in names}
    )


def solve(cases, max_distance=np.inf, *, certify=False):
    """Return the Answers of all cases; ``certify`` fills their gaps."""
    table = table_of(cases)
    X_WG = np.ascontiguousarray(np.array([X for c in cases for X in (c.X_WA, c.X_WB)]))
    pairs = np.arange(2 * len(cases)).reshape(-1, 2)
    solved = solve_pairs(hold(table), X_WG, pairs, float(max_distance), WITHIN, certify=certify)
    assert solved.failed == NO_FAILURE
    assert len(solved) == len(cases), "a distance is nan or beyond infinity"
    return Answers(
        solved.distance,
        solved.p_ACa,
        solved.p_BCb,
        solved.p_WCa,
        solved.p_WCb,
        solved.nhat_BA_W,
        solved.is_unique,
        solved.gap,
        solved.decided_by,
    )


def swapped(cases):
    """Return the cases with A and B exchanged, without the true normal and witness."""
    return [
        c._replace(
            A=c.B,
            B=c.A,
            X_WA=c.X_WB,
            X_WB=c.X_WA,
            triangles=c.triangles[::-1],
            nhat_BA_W=None,
            p_ACa=None,
        )
        for c in cases
    ]


def size(case):
    """Return L, the larger of the two finite sizes."""
    return max(extent(case.A), extent(case.B))


def relative(X_WA, X_WB):
    """Return X_AB; positions are subtracted first, which is exact for nearby ones."""
    R_AW = X_WA[:3, :3].T
    return pose(R_AW @ X_WB[:3, :3], R_AW @ (X_WB[:3, 3] - X_WA[:3, 3]))


def _off(shape, triangles, x):
    """Return how far x is from the surface; of triangles only how far outside of their hull."""
    depth = outside(shape, x)
    return max(depth, 0.0) if triangles else abs(depth)


def faults(case, answers, k, directions=None):
    """Return by how much answer k violates what holds for every pair of convex bodies.

    Lengths in metres, all of them 0 for a perfect answer. ``tight``: along the normal the bodies
    are as far apart as is said; for bodies apart this and the containment of the witnesses prove
    the distance. ``beaten``: some of ``directions`` separates more, so the depth is too large.
    """
    X_AB = relative(case.X_WA, case.X_WB)
    R, p = X_AB[:3, :3], X_AB[:3, 3]
    n = case.X_WA[:3, :3].T @ answers.nhat_BA_W[k]
    phi, p_ACa, p_BCb = answers.distance[k], answers.p_ACa[k], answers.p_BCb[k]
    found = {
        "unit": abs(np.linalg.norm(answers.nhat_BA_W[k]) - 1.0),
        "identity": np.linalg.norm(p_ACa - (R @ p_BCb + p) - phi * n),
        "off A": _off(case.A, case.triangles[0], p_ACa),
        "off B": _off(case.B, case.triangles[1], p_BCb),
        "tight": abs(gaps(case.A, case.B, X_AB, n) - phi),
    }
    if not np.isnan(case.truth):
        found["distance"] = abs(phi - case.truth)
    if (
        directions is not None
        and not isinstance(case.A, HalfSpace)
        and not isinstance(case.B, HalfSpace)
    ):
        found["beaten"] = max(gaps(case.A, case.B, X_AB, directions).max() - phi, 0.0)
    return {name: value if value == value else np.inf for name, value in found.items()}


def complaints(cases, answers=None, *, bound=1e-12, directions=None):
    """Return a Complaint for everything that is off by more than ``bound`` times L, worst first.

    The normal has a bound of its own: between two points ``phi`` apart the direction is known to
    the rounding of a position, over ``phi``; that times L is what the gap along it may be off. It
    has to separate the bodies also when they touch, to 1e-9 L; so it has next to contact.
    """
    answers = solve(cases) if answers is None else answers
    found = []
    for k, case in enumerate(cases):
        L = size(case)
        phi = abs(answers.distance[k])
        of_normal = 1e-9
        if phi > 1e-12 * L:
            of_normal = min(16.0 * EPSILON * L / phi, 1e-9)
        # A body much smaller than its distance from the other is placed to this rounding.
        rounding = 16.0 * EPSILON * np.linalg.norm(case.X_WB[:3, 3] - case.X_WA[:3, 3])
        bounds = {"unit": 1e-12, "tight": (bound + of_normal) * L + rounding}
        for name, value in faults(case, answers, k, directions).items():
            if not value <= bounds.get(name, bound * L + rounding):
                found.append(Complaint(value / L, case.label, name, case.truth))
    return sorted(found, reverse=True)
