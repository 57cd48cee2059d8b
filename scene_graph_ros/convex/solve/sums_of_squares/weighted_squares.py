"""Polynomials that are to be weighted sums of squares, at the least cost.

For programs of many small Gram matrices, by a method that is written for them; `ConeProgram` is
for others. Answers are floats that prove nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.sums_of_squares.gram_kernels import GroupTable
from scene_graph_ros.convex.solve.sums_of_squares.gram_search import improve, SOLVED
from scene_graph_ros.convex.solve.sums_of_squares.gram_steps import GramProgram, Point, Rest

__all__ = ["Identities", "WeightedSquares", "minimize_over_squares"]

_MOST_ITERATIONS = 60

_MOST_NUMBERS = 5e8
"""Of all systems together: four gigabytes."""


@dataclass(frozen=True)
class Identities:
    """Some identities ``sum over rows of row(u) m(u)' G m(u) = constants + factors x``.

    All of these have the basis m, and the first ``num_rows`` rows of a program. ``base (m, m)``
    numbers the products of two monomials of the basis from 0 on, ``shift (n + 1, q)`` the
    monomials that these are times 1 and times each variable. ``constants (p, k)`` and
    ``factors (p, k, f)`` are of each identity's monomials.
    """

    base: NDArray[np.int64]
    shift: NDArray[np.int64]
    num_rows: int
    constants: NDArray[np.float64]
    factors: NDArray[np.float64]

    @property
    def num_entries(self) -> int:
        """How many entries all Gram matrices have."""
        return len(self.constants) * self.num_rows * self.base.size


@dataclass(frozen=True)
class WeightedSquares:
    """Where the search ended; ``is_solved`` if the cost is as near to the bound as was asked.

    ``x (f,)``; of each part of the program ``grams (p, r, m, m)``, which are positive definite.
    The identities are off by ``residual``. No cost, with that of traces, is below ``bound``, but
    for the residual of its moments.
    """

    is_solved: bool
    x: NDArray[np.float64]
    grams: tuple[NDArray[np.float64], ...]
    bound: float
    residual: float
    iterations: int


def minimize_over_squares(
    rows: NDArray[np.float64],
    parts: Sequence[Identities],
    cost: NDArray[np.float64],
    *,
    gap: float,
    least: float,
    weights: NDArray[np.float64] | None = None,
) -> WeightedSquares:
    """Minimize ``cost . x`` where all identities hold with semidefinite Gram matrices.

    ``rows (r, n + 1)`` are affine in the variables u, the constant first. The search ends where
    the cost is no farther from a bound than ``gap`` times its size, or than ``least``; or where
    rounding does not let it go on. Coefficients are to be near 1 in size. With ``weights (r,)``
    the trace of each row's Gram matrices costs as much as that, too. Raises SolverError where the
    systems need more than 4 GB.
    """
    program = GramProgram(
        _table(rows, parts, len(cost)),
        np.concatenate([each.constants.reshape(-1) for each in parts]),
        np.concatenate([each.factors.reshape(-1, len(cost)) for each in parts]),
        cost,
        np.zeros(len(rows)) if weights is None else weights,
    )
    units = np.concatenate(
        [
            np.tile(np.eye(len(each.base)).reshape(-1), each.num_entries // each.base.size)
            for each in parts
        ]
    )
    k, f, entries = len(program.constants), len(cost), len(units)
    point = Point(np.zeros(f), np.zeros(k), units, units.copy())
    step = Point(np.zeros(f), np.zeros(k), np.zeros(entries), np.zeros(entries))
    systems = sum(len(c) * c.shape[1] * (c.shape[1] + f) for c in (p.constants for p in parts))
    if systems > _MOST_NUMBERS:
        raise SolverError(
            f"weighted sums of squares: {len(program.table.groups)} identities of up to"
            f" {max(p.constants.shape[1] for p in parts)} monomials need {systems:.1e} numbers,"
            f" more than {_MOST_NUMBERS:.0e}"
        )
    largest = max(max(each.shift.shape[1] ** 2, 2 * each.base.size) for each in parts)
    sizes = (k, entries, f, entries, entries, systems, f * f, k, f, largest)
    rest = Rest(*(np.zeros(size) for size in sizes))
    order = float(units.sum())
    status, count = improve(program, point, step, rest, order, gap, least, _MOST_ITERATIONS)
    ends = np.cumsum([each.num_entries for each in parts])
    return WeightedSquares(
        status == SOLVED,
        point.x,
        tuple(
            own.reshape(-1, each.num_rows, *each.base.shape)
            for own, each in zip(np.split(point.grams, ends[:-1]), parts, strict=True)
        ),
        -float(program.constants @ point.moments),
        float(np.abs(rest.identities).max()),
        count,
    )


def _table(rows: NDArray[np.float64], parts: Sequence[Identities], f: int) -> GroupTable:
    """Return the table of a group's indices."""
    groups = []
    base = shift = moment = gram = system = 0
    for each in parts:
        m, q = len(each.base), each.shift.shape[1]
        count, k = each.constants.shape
        for _ in range(count):
            groups.append((m, each.num_rows, k, q, base, shift, moment, gram, system))
            moment, gram = moment + k, gram + each.num_rows * m * m
            system += k * (k + f)
        base, shift = base + each.base.size, shift + each.shift.size
    return GroupTable(
        np.array(groups, dtype=np.int64).reshape(-1, 9),
        np.concatenate([each.base.reshape(-1) for each in parts]),
        np.concatenate([each.shift.reshape(-1) for each in parts]),
        rows,
    )
