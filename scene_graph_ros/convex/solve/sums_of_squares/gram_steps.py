"""Steps of an interior-point method for weighted sums of squares of small Gram matrices.

Along the direction that makes ``G S`` symmetric by the localizing matrix S (Helmberg, Rendl,
Vanderbei and Wolkowicz, "An interior-point method for semidefinite programming", 1996). Each
identity has a small system of its moments; the free variables x are the
common part: the systems' border.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.bordered_systems import (
    add_border,
    eliminate,
    substitute_backward,
    substitute_forward,
)
from scene_graph_ros.convex.solve.sums_of_squares.gram_kernels import (
    add_monomials,
    add_scaled,
    add_schur,
    FIRST_GRAM,
    FIRST_MOMENT,
    FIRST_SYSTEM,
    GroupTable,
    invert,
    localize,
    MOMENTS,
    ORDER,
    ROWS,
)
from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["GramProgram", "Point", "Rest", "center", "find_direction", "measure", "prepare"]


class GramProgram(NamedTuple):
    """Minimize ``cost . x`` where each identity's polynomial is ``constants + factors x``.

    ``constants (k,)``, ``factors (k, f)``: the monomials of all groups in turn. The traces of each
    row's Gram matrices cost ``weights (r,)`` times as much as they are.
    """

    table: GroupTable
    constants: np.ndarray
    factors: np.ndarray
    cost: np.ndarray
    weights: np.ndarray


class Point(NamedTuple):
    """Where the method is, or a step: free variables, moments, Gram and localizing matrices."""

    x: np.ndarray
    moments: np.ndarray
    grams: np.ndarray
    slacks: np.ndarray


class Rest(NamedTuple):
    """The residuals of a point, and its factors.

    ``identities``, ``slacks`` and ``columns`` are to be zero. ``inverses`` are those of the
    localizing matrices, ``wanted`` is the step of the Gram matrices without the moments' part of
    it. ``systems`` and ``border`` are factored; the arrays below are overwritten.
    """

    identities: np.ndarray
    slacks: np.ndarray
    columns: np.ndarray
    inverses: np.ndarray
    wanted: np.ndarray
    systems: np.ndarray
    border: np.ndarray
    sides: np.ndarray
    change_x: np.ndarray
    room: np.ndarray


@lean_kernel
def measure(program, point, rest):
    """Set the residuals of a point; return its cost, and the product of all matrices."""
    table, factors = program.table, program.factors
    x, y = point.x, point.moments
    f = len(x)
    for j in range(f):
        rest.columns[j] = program.cost[j]
    for e in range(len(y)):
        value = program.constants[e]
        for j in range(f):
            value += factors[e, j] * x[j]
            rest.columns[j] -= factors[e, j] * y[e]
        rest.identities[e] = value
        rest.sides[e] = 0.0
    for g in range(len(table.groups)):
        add_monomials(table, g, point.grams, rest.room, rest.sides)
        localize(table, g, y, rest.room, rest.slacks)
    for e in range(len(y)):
        rest.identities[e] -= rest.sides[e]
    value, product = 0.0, 0.0
    for j in range(f):
        value += program.cost[j] * x[j]
    for i in range(len(point.grams)):
        rest.slacks[i] -= point.slacks[i]
        product += point.grams[i] * point.slacks[i]
    return value + _weigh(program, point, rest), product


@lean_kernel
def _weigh(program, point, rest):
    """Add the cost of traces to the residuals of matrices; return the cost."""
    groups, value = program.table.groups, 0.0
    for g in range(len(groups)):
        m, at = groups[g, ORDER], groups[g, FIRST_GRAM]
        for r in range(groups[g, ROWS]):
            for i in range(m):
                rest.slacks[at + i * m + i] += program.weights[r]
                value += program.weights[r] * point.grams[at + i * m + i]
            at += m * m
    return value


@lean_kernel
def prepare(program, point, rest):
    """Factor the systems at a point, and set the wanted step without centering.

    False where rounding does not allow it.
    """
    table, f = program.table, len(point.x)
    groups = table.groups
    for i in range(len(rest.systems)):
        rest.systems[i] = 0.0
    for i in range(f * f):
        rest.border[i] = 0.0
    for i in range(len(rest.wanted)):
        rest.wanted[i] = -point.grams[i]
    for g in range(len(groups)):
        m, k, at = groups[g, ORDER], groups[g, MOMENTS], groups[g, FIRST_GRAM]
        for _ in range(groups[g, ROWS]):
            if not invert(m, at, point.slacks, rest.room, rest.inverses):
                return False
            add_scaled(
                m, at, -1.0, point.grams, rest.slacks, rest.inverses, rest.room, rest.wanted
            )
            at += m * m
        first, width = groups[g, FIRST_SYSTEM], k + f
        add_schur(table, g, point.grams, rest.inverses, width, rest.room, rest.systems)
        for e in range(k):
            for j in range(f):
                factor = program.factors[groups[g, FIRST_MOMENT] + e, j]
                rest.systems[first + e * width + k + j] = factor
        if not eliminate(k, width, first, rest.systems):
            return False
        add_border(k, f, first, rest.systems, rest.border)
    return eliminate(f, f, 0, rest.border)


@lean_kernel
def center(table, mean, step, rest):
    """Add to the wanted step: products of ``mean``, less what the predictor's step leaves out."""
    groups = table.groups
    for i in range(len(rest.wanted)):
        rest.wanted[i] += mean * rest.inverses[i]
    for g in range(len(groups)):
        m, at = groups[g, ORDER], groups[g, FIRST_GRAM]
        for _ in range(groups[g, ROWS]):
            add_scaled(m, at, -1.0, step.grams, step.slacks, rest.inverses, rest.room, rest.wanted)
            at += m * m


@lean_kernel
def find_direction(program, point, rest, step, refinements):
    """Set the step to the wanted Gram matrices with zero residuals.

    Where matrices are nearly singular, so are the systems: the step's residuals are solved
    for again, ``refinements`` times.
    """
    table = program.table
    _fill(step.x, 0.0)
    _fill(step.moments, 0.0)
    for j in range(len(step.x)):
        rest.change_x[j] = -rest.columns[j]
    for e in range(len(rest.sides)):
        rest.sides[e] = -rest.identities[e]
    for g in range(len(table.groups)):
        add_monomials(table, g, rest.wanted, rest.room, rest.sides)
    for round_ in range(refinements + 1):
        if round_ > 0:
            _find_rest(program, rest, step)
        _solve(program, rest)
        for j in range(len(step.x)):
            step.x[j] += rest.change_x[j]
        for e in range(len(step.moments)):
            step.moments[e] += rest.sides[e]
        _follow(program, point, rest, step)
    for i in range(len(step.slacks)):
        step.slacks[i] += rest.slacks[i]


@lean_kernel
def _find_rest(program, rest, step):
    """Set the right sides to a step's residuals."""
    table, factors, f = program.table, program.factors, len(step.x)
    for j in range(f):
        rest.change_x[j] = -rest.columns[j]
    _fill(rest.sides, 0.0)
    for g in range(len(table.groups)):
        add_monomials(table, g, step.grams, rest.room, rest.sides)
    for e in range(len(rest.sides)):
        value = rest.sides[e] - rest.identities[e]
        for j in range(f):
            value -= factors[e, j] * step.x[j]
            rest.change_x[j] += factors[e, j] * step.moments[e]
        rest.sides[e] = value


@lean_kernel
def _solve(program, rest):
    """Replace right sides, of the moments and of x, by the solution of the systems."""
    groups, f = program.table.groups, len(rest.change_x)
    x, sides, systems = rest.change_x, rest.sides, rest.systems
    for g in range(len(groups)):
        k, y0, first = groups[g, MOMENTS], groups[g, FIRST_MOMENT], groups[g, FIRST_SYSTEM]
        substitute_forward(k, k + f, first, systems, y0, sides)
        for e in range(k):
            for j in range(f):
                x[j] += systems[first + e * (k + f) + k + j] * sides[y0 + e]
    substitute_forward(f, f, 0, rest.border, 0, x)
    substitute_backward(f, f, 0, rest.border, 0, x)
    for g in range(len(groups)):
        k, y0, first = groups[g, MOMENTS], groups[g, FIRST_MOMENT], groups[g, FIRST_SYSTEM]
        for e in range(k):
            value = sides[y0 + e]
            for j in range(f):
                value -= systems[first + e * (k + f) + k + j] * x[j]
            sides[y0 + e] = value
        substitute_backward(k, k + f, first, systems, y0, sides)


@lean_kernel
def _follow(program, point, rest, step):
    """Set a step's matrices from its moments."""
    table, groups = program.table, program.table.groups
    for i in range(len(step.grams)):
        step.grams[i] = rest.wanted[i]
    for g in range(len(groups)):
        localize(table, g, step.moments, rest.room, step.slacks)
        m, at = groups[g, ORDER], groups[g, FIRST_GRAM]
        for _ in range(groups[g, ROWS]):
            add_scaled(m, at, -1.0, point.grams, step.slacks, rest.inverses, rest.room, step.grams)
            at += m * m


@lean_kernel
def _fill(values, value):
    for i in range(len(values)):
        values[i] = value
