"""Measure a kind of core that the package does not know, and print what came out.

Run in a process of its own, as the questions, made when they are imported, are made once more:
``python ninth_core.py pairs|overlaps COUNT``. Distances are constructed: two bodies with opposite
outward normals at two points of their surfaces, moved apart along the normal, have that distance.
A depth is compared with those along many directions. One line of JSON for each pair.
"""

import json
import math
import sys

import numpy as np
import truncated_cone

from scene_graph_ros.geometry.narrowphase.cores import kinds, registry

TRUNCATED_CONE = 7
registry.FILES[TRUNCATED_CONE] = truncated_cone
for name in [name for name in sys.modules if ".narrowphase." in name and ".cores." not in name]:
    del sys.modules[name]
del sys.modules[registry.__name__.replace("registry", "questions")]

from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance  # noqa: E402
from scene_graph_ros.geometry.narrowphase.cores import questions  # noqa: E402

NO_HULLS = np.zeros(8)
SIZES = (1e-4, 1.0, 1e3)
GAPS = (1e-6, 1e-3, 0.1, 1.0)
DIRECTIONS = 4000


def core_of(kind, numbers, radius=0.0):
    """Return a core."""
    return kind, -1, radius, tuple(map(np.float64, (*numbers, *(0.0,) * (9 - len(numbers)))))


def unit(v):
    """Return the unit vector along v."""
    return np.asarray(v, float) / np.linalg.norm(v)


def cone_at(numbers, rng):
    """Return (point, outward normal) on a line of the surface, a rim, an end, or the upper rim."""
    low, high, half = numbers
    angle = rng.uniform(0.0, 2.0 * np.pi)
    across = np.array([math.cos(angle), math.sin(angle), 0.0])
    beside = unit([2.0 * half * across[0], 2.0 * half * across[1], low - high])
    place = rng.integers(3)
    if place == 0:
        s = rng.uniform()
        r, z = (1.0 - s) * low + s * high, (2.0 * s - 1.0) * half
        return np.array([r * across[0], r * across[1], z]), beside
    top = bool(rng.integers(2))
    r, z = (high, half) if top else (low, -half)
    axis = np.array([0.0, 0.0, 1.0 if top else -1.0])
    if place == 1:
        share = rng.uniform()
        return r * across + [0.0, 0.0, z], unit(share * beside + (1.0 - share) * axis)
    return r * rng.uniform() * across + [0.0, 0.0, z], axis


def box_at(numbers, rng):
    """Return (point, outward normal) of a corner, an edge or a face."""
    free = rng.permutation(3) < rng.integers(3)
    sign = rng.choice([-1.0, 1.0], 3)
    q = np.where(free, rng.uniform(-1.0, 1.0, 3), sign) * numbers
    return q, unit(np.where(free, 0.0, sign * rng.uniform(0.05, 1.0, 3)))


def cylinder_at(numbers, rng):
    """Return (point, outward normal) of its side, a rim or an end."""
    return cone_at((numbers[0], numbers[0], numbers[1]), rng)


def ellipsoid_at(numbers, rng):
    """Return (point, outward normal)."""
    n = unit(rng.normal(size=3))
    axes = np.array(numbers)
    return axes * axes * n / np.linalg.norm(axes * n), n


def segment_at(numbers, rng):
    """Return (point, outward normal) of the line or an end."""
    if rng.integers(2):
        return np.array([0.0, 0.0, rng.uniform(-1.0, 1.0) * numbers[0]]), unit(
            [*rng.normal(size=2), 0.0]
        )
    n = unit(rng.normal(size=3))
    return np.array([0.0, 0.0, math.copysign(numbers[0], n[2])]), n


def point_at(numbers, rng):
    """Return (point, outward normal)."""
    return np.zeros(3), unit(rng.normal(size=3))


OTHERS = {
    "truncated cone": (TRUNCATED_CONE, 3, cone_at),
    "box": (kinds.BOX, 3, box_at),
    "cylinder": (kinds.CYLINDER, 2, cylinder_at),
    "ellipsoid": (kinds.ELLIPSOID, 3, ellipsoid_at),
    "segment": (kinds.SEGMENT, 1, segment_at),
    "point": (kinds.POINT, 0, point_at),
}


def rotation(rng):
    """Return a random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def aligned(n_A, n_B, rng):
    """Return a random rotation that takes n_B to -n_A."""
    turn = rotation(rng)
    v, w = turn @ n_B, -n_A
    axis, cosine = np.cross(v, w), float(v @ w)
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return (np.eye(3) + K + K @ K / (1.0 + cosine)) @ turn


def numbers_of(count, size, rng):
    """Return the lengths of a body (m), the thinnest a fifth of the longest."""
    return tuple(size * rng.uniform(0.2, 1.0, count))


def extent(core, d):
    """Return how far a core reaches along the unit vector d of its frame."""
    x, _ = getattr(questions.support, "py_func", questions.support)(core, NO_HULLS, tuple(d))
    return float(np.dot(x, d)) + core[2]


def separation(core_A, core_B, R, p, n):
    """Return how far A and B are apart along n, a unit vector out of B into A."""
    return float(-n @ p) - extent(core_A, -n) - extent(core_B, R.T @ n)


def most_apart(core_A, core_B, R, p, rng):
    """Return the largest separation of many directions, and of some around the best of them."""
    best, at = -math.inf, None
    spread = 0.0
    for k in range(DIRECTIONS):
        if k % 1000 == 0:
            spread = 1.0 if k == 0 else 0.1 * spread
        n = unit(rng.normal(size=3) if k < 1000 else at + spread * rng.normal(size=3))
        along = separation(core_A, core_B, R, p, n)
        if along > best:
            best, at = along, n
    return best


def cases(count, rng):
    """Yield (name, core A, core B, R_AB, p_AB, gap or None, size), depths with no gap known."""
    names = list(OTHERS)
    for k in range(count):
        name = names[k % len(names)]
        kind, how_many, at = OTHERS[name]
        size = SIZES[k // len(names) % len(SIZES)]
        a, b = numbers_of(3, size, rng), numbers_of(how_many, size, rng)
        radius = 0.3 * size if name in ("segment", "point") else 0.0
        core_A, core_B = core_of(TRUNCATED_CONE, a), core_of(kind, b, radius)
        (q_A, n_A), (q_B, n_B) = cone_at(a, rng), at(b, rng)
        R = aligned(n_A, n_B, rng)
        gap = float(rng.choice(GAPS)) * size
        yield name, core_A, core_B, R, q_A + (gap + radius) * n_A - R @ q_B, gap, size


def measure(core_A, core_B, R, p):
    """Return what the package says."""
    return convex_distance(core_A, core_B, tuple(R.ravel()), tuple(p), NO_HULLS, math.inf, 0.0)


def main():
    """Print the relative errors of each pair."""
    # Not compiled, numbers of Python raise where kernels divide by zero; those of numpy don't.
    math.sqrt = np.sqrt
    np.seterr(all="ignore")
    what, count = sys.argv[1], int(sys.argv[2])
    rng = np.random.default_rng(20)
    for name, core_A, core_B, R, p, gap, size in cases(count, rng):
        truth = gap
        if what == "overlaps":
            p = p * rng.uniform(0.0, 0.5)
        phi, a, b, n, _, error, by = measure(core_A, core_B, R, p)
        n = np.array(n)
        if what == "overlaps":
            truth = most_apart(core_A, core_B, R, p, rng)
        misfit = np.linalg.norm(np.subtract(a, b) - phi * n)
        along = separation(core_A, core_B, R, p, unit(n))
        result = {"name": name, "phi": phi / size, "truth": truth / size, "by": int(by)}
        result |= {
            "misfit": misfit / size,
            "gap": error / size,
            "along": along / size,
        }
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
