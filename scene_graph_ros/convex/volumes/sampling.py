"""Draw points of a polyhedron: one after another, or by many chains at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import (
    as_generator,
    as_matrix,
    as_nonnegative,
    as_vector,
    as_whole,
)
from scene_graph_ros.convex.questions.ellipsoids import inscribed
from scene_graph_ros.convex.volumes.effective_sample_size import (
    effective_sample_size,
)
from scene_graph_ros.convex.volumes.hit_and_run import hit_and_run, walk_along_axes
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["UniformSamples", "draw", "draw_many"]

_FORGET = 10
"""Steps for each two coordinates, after which a chain in a round set has forgotten its start."""

_MOST = 100_000_000
"""Points, chains or steps."""

_START_OUTSIDE = 1e-8
"""In the set's own units: how far outside a start may be."""


def draw(
    polyhedron: Any,
    generator: np.random.Generator,
    previous: Any,
    mixing_steps: int,
    subspace: Any,
    tol: float,
) -> np.ndarray:
    """Walk ``mixing_steps`` steps in a polyhedron, as `HPolyhedron.uniform_sample` says."""
    label, n = "HPolyhedron.uniform_sample", polyhedron.ambient_dimension
    as_generator(generator, f"{label}: generator")
    mixing_steps = as_whole(mixing_steps, f"{label}: mixing_steps", 0, _MOST)
    if n == 0:
        return np.zeros(0)
    x = (
        polyhedron.chebyshev_center()
        if previous is None
        else as_vector(previous, f"{label}: previous_sample", n)
    )
    if not polyhedron.point_in_set(x, _START_OUTSIDE):
        raise ConvexSetError(
            f"{label}: previous_sample {x.tolist()} is outside; start with a point of the set"
        )
    basis = np.eye(n) if subspace is None else as_matrix(subspace, f"{label}: subspace")
    if len(basis) != n:
        raise ConvexSetError(f"{label}: subspace must have the shape ({n}, k), not {basis.shape}")
    lengths = np.linalg.norm(polyhedron.A, axis=1)
    A, b = polyhedron.A[lengths > 0.0], polyhedron.b[lengths > 0.0]
    A, b = A / lengths[lengths > 0.0, None], b / lengths[lengths > 0.0]
    crosses = np.linalg.norm(A @ basis, axis=1) > as_nonnegative(tol, f"{label}: tol")
    A, slack, step = A[crosses], (b - A @ x)[crosses], np.zeros(n)
    ways = generator.normal(size=(mixing_steps, basis.shape[1])) @ basis.T
    shares = generator.random(mixing_steps)
    if basis.shape[1] and not hit_and_run(A, slack, ways @ A.T, ways, shares, step):
        raise ConvexSetError(f"{label}: the set is unbounded; intersect it with a box")
    return x + step


@one_line()
class UniformSamples(NamedTuple):
    """Points ``(m, n)``, nearly uniform, and how many independent ones they are worth.

    The latter is the least of all coordinates, in which the set is round; NaN of fewer than four
    points for each of ``num_chains`` chains, whose points come one chain after the other.
    """

    points: np.ndarray
    effective_sample_size: float
    num_chains: int


def draw_many(
    polyhedron: Any,
    generator: np.random.Generator,
    num_samples: int,
    mixing_steps: int | None,
    num_chains: int,
) -> UniformSamples:
    """Walk with many chains at once, as `HPolyhedron.uniform_samples` says."""
    label, n = "HPolyhedron.uniform_samples", polyhedron.ambient_dimension
    as_generator(generator, f"{label}: generator")
    wanted = as_whole(num_samples, f"{label}: num_samples", 1, _MOST)
    chains = min(as_whole(num_chains, f"{label}: num_chains", 1, _MOST), wanted)
    # A step along an axis changes one of n coordinates.
    between = 4 * n if mixing_steps is None else mixing_steps
    steps = as_whole(between, f"{label}: mixing_steps", 0 if n == 0 else 1, _MOST)
    if n == 0:
        return UniformSamples(np.zeros((wanted, 0)), float(wanted), chains)
    found = inscribed(polyhedron)
    named = polyhedron.A.any(axis=1)
    A, b = polyhedron.A[named], polyhedron.b[named]
    rows = (A @ found.B) / (b - A @ found.center)[:, None]
    columns = np.ascontiguousarray(rows.T)
    ways = generator.normal(size=(chains, n))
    reach = generator.random(chains) ** (1.0 / n) / np.linalg.norm(ways, axis=1)
    points = ways * reach[:, None]
    slacks = 1.0 - points @ columns
    length = -(-wanted // chains)
    kept = np.empty((chains, length, n))
    for k in range(length):
        # The first comes after as many steps as all chains need to forget where they began.
        count = steps if k else _FORGET * n * n + steps
        places = generator.integers(0, n, size=(count, chains))
        walk_along_axes(columns, slacks, points, places, generator.random((count, chains)))
        # What rounding added up in the slacks begins anew.
        slacks = 1.0 - points @ columns
        kept[:, k] = points
    worth = effective_sample_size(kept)
    drawn = kept.reshape(-1, n)[:wanted]
    return UniformSamples(found.center + drawn @ found.B.T, worth, chains)
