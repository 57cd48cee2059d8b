"""The program that moves a polytope's faces outwards while planes keep all pairs apart.

The Gram matrices of the polytope's own rows are given, and everything else is free: planes, the
matrices of the bounds, and the rows themselves. The sum of the faces' margins from an ellipsoid
that stays inside, or their geometric mean, is the largest (Dai, Amice, Werner, Zhang and Tedrake,
"Certified polyhedral decompositions of collision-free configuration space", 2023, section V).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.search_options import (
    EllipsoidMarginCost,
    FindPolytopeGivenLagrangianOptions,
)
from scene_graph_ros.planning.certified.separation_program import (
    MovingRows,
    SeparationProgram,
    Solution,
)
from scene_graph_ros.planning.certified.tangent_region import TangentRegion

__all__ = ["grown_rows"]

_LEAST_CLEARANCE, _KEPT_CLEARANCE = 1e-5, 0.3
"""Metres that planes keep on each side, and the share of what they had before: so the polytope can
be proven afterwards, and can grow on."""

_LEAST_NORMAL = 1e-6
"""A row with a shorter normal bounds nothing."""


def grown_rows(
    problems: Sequence[PairProblem],
    solutions: Sequence[Solution],
    region: TangentRegion,
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    options: FindPolytopeGivenLagrangianOptions,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rows C ``(m, n)``, of length 1 where they bound something, and sides d ``(m,)``.

    ``{B z + center}`` for all ``|z| <= 1`` stays inside, as do the options' points. Where some of
    the cost is given up, planes keep most of their clearance. Raises SolverError.
    """
    clearances = []
    program = ConeProgram()
    m, n = region.C.shape
    C, d = program.variables(m * n).reshape(m, n), program.variables(m)
    for problem, solution in zip(problems, solutions, strict=True):
        moving = _moving_rows(problem, solution, region, C, d)
        part = SeparationProgram(problem, program, moving)
        program.add_entries(
            Cone.NONNEGATIVE,
            [(np.array([0]), np.array([part.clearance]), np.ones(1))],
            np.array([-max(_KEPT_CLEARANCE * solution.clearance, _LEAST_CLEARANCE)]),
        )
        clearances.append((part.clearance, solution.clearance))
        if not options.search_s_bounds_lagrangians:
            part.keep_bounds(solution)
    widest = float(np.linalg.norm(region.upper - region.lower))
    margins = _keep_ellipsoid(program, C, d, B, center, widest)
    for row in range(m):
        for point in options.s_inner_pts:
            blocks = [(d[row : row + 1], np.ones((1, 1))), (C[row], -np.array([point]))]
            program.add_rows(Cone.NONNEGATIVE, blocks, np.zeros(1))
    if options.ellipsoid_margin_cost is EllipsoidMarginCost.SUM:
        program.add_cost(margins, -np.ones(m))
    else:
        _add_geometric_mean(program, margins, options.ellipsoid_margin_epsilon)
    x = _solved(program, options)
    if options.backoff_scale is not None:
        best = program.cost_of(x)
        program.bound_cost(best + options.backoff_scale * abs(best))
        (least,) = program.variables(1)
        for clearance, before in clearances:
            entries = [
                (np.zeros(1, dtype=np.int64), np.array([clearance]), np.ones(1)),
                (np.zeros(1, dtype=np.int64), np.array([least]), np.array([-before])),
            ]
            program.add_entries(Cone.NONNEGATIVE, entries, np.zeros(1))
        program.add_cost(np.array([least]), -np.ones(1))
        x = _solved(program, options)
    lengths = np.linalg.norm(x[C], axis=1)
    kept = lengths > _LEAST_NORMAL
    return x[C][kept] / lengths[kept, np.newaxis], x[d][kept] / lengths[kept]


def _solved(
    program: ConeProgram, options: FindPolytopeGivenLagrangianOptions
) -> NDArray[np.float64]:
    found = program.solve("the polytope's faces", by=options.solver)
    if not found.is_feasible:
        raise SolverError("the polytope's faces: the program has no solution, as nearly no room")
    return found.x


def _moving_rows(
    problem: PairProblem,
    solution: Solution,
    region: TangentRegion,
    C: NDArray[np.intp],
    d: NDArray[np.intp],
) -> MovingRows:
    """Return the region's rows in u: ``(d - C middle) / scale``, and ``-C_k half_k / scale``."""
    stretches = region.stretches(list(problem.variables))
    rows = []
    for number, scale in zip(problem.row_numbers, problem.row_scales, strict=True):
        weight = float(scale)
        own = [int(C[number, k]) for k in problem.variables]
        parts = [
            (column, -float(s.middle) / weight) for column, s in zip(own, stretches, strict=True)
        ]
        slopes = [
            ((column, -float(s.half) / weight),) for column, s in zip(own, stretches, strict=True)
        ]
        rows.append((((int(d[number]), 1.0 / weight), *parts), *slopes))
    first = 2 * len(problem.variables) + 1
    return MovingRows(tuple(rows), tuple(own[first:] for side in solution.grams for own in side))


def _keep_ellipsoid(
    program: ConeProgram,
    C: NDArray[np.intp],
    d: NDArray[np.intp],
    B: NDArray[np.float64],
    center: NDArray[np.float64],
    widest: float,
) -> NDArray[np.intp]:
    """Ask that faces are beyond an ellipsoid by margins, with normals no longer than 1."""
    m, n = C.shape
    margins = program.variables(m)
    one = np.ones((1, 1))
    for row in range(m):
        own = [d[row : row + 1], C[row], margins[row : row + 1]]
        # d - C center - margin >= |B' C|.
        blocks = [
            (own[0], np.vstack([one, np.zeros((n, 1))])),
            (own[1], np.vstack([-center, B.T])),
            (own[2], np.vstack([-one, np.zeros((n, 1))])),
        ]
        program.add_rows(Cone.SECOND_ORDER, blocks, np.zeros(n + 1))
        length = np.vstack([np.zeros((1, n)), np.eye(n)])
        program.add_rows(Cone.SECOND_ORDER, [(own[1], length)], np.eye(n + 1)[0])
    program.add_rows(Cone.NONNEGATIVE, [(margins, np.eye(m))], np.zeros(m))
    program.add_rows(Cone.NONNEGATIVE, [(margins, -np.eye(m))], np.full(m, widest))
    return margins


def _add_geometric_mean(program: ConeProgram, margins: NDArray[np.intp], epsilon: float) -> None:
    """Ask for the largest product of margins and epsilon: the sum of their logarithms."""
    logarithms = program.variables(len(margins))
    for margin, logarithm in zip(margins, logarithms, strict=True):
        # exp(logarithm) <= margin + epsilon.
        blocks = [
            (np.array([logarithm]), np.array([[1.0], [0.0], [0.0]])),
            (np.array([margin]), np.array([[0.0], [0.0], [1.0]])),
        ]
        program.add_rows(Cone.EXPONENTIAL, blocks, np.array([0.0, 1.0, epsilon]))
    program.add_cost(logarithms, -np.ones(len(margins)))
