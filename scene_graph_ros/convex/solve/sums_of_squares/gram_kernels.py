"""Gram matrices weighted by rows, and moments: steps of an interior-point method.

A group is an identity ``sum over rows of row(u) m(u)' G m(u) = p(u)`` with a Gram matrix G of
order m for each row, all of one basis. In all groups together matrices are one array, each line by
line, the groups' rows in turn; of a group g

- ``base`` numbers the products of two monomials of the basis, ``(m, m)`` numbers below q,
- ``shift`` numbers the monomials that these are times 1 and times each variable, ``(n + 1, q)``
  numbers below k,
- ``rows (r, n + 1)`` are the constant and the slopes of each row.

Moments are a number for each monomial; of them a row makes its localizing matrix (Lasserre,
"Global optimization with polynomials and the problem of moments", 2001).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = [
    "FIRST_GRAM",
    "FIRST_MOMENT",
    "FIRST_SYSTEM",
    "MOMENTS",
    "ORDER",
    "PRODUCTS",
    "ROWS",
    "GroupTable",
    "add_monomials",
    "add_scaled",
    "add_schur",
    "invert",
    "localize",
    "longest_step",
]

ORDER, ROWS, MOMENTS, PRODUCTS, BASE, SHIFT, FIRST_MOMENT, FIRST_GRAM, FIRST_SYSTEM = range(9)
"""Columns of the groups' table: m, r, k, q, and where in other arrays a group begins."""

_HALVINGS = 8
"""How often the interval between a step that is too long and one that is not is halved."""


class GroupTable(NamedTuple):
    """All groups; ``groups (g, 9)``, ``base`` and ``shift`` are whole numbers."""

    groups: np.ndarray
    base: np.ndarray
    shift: np.ndarray
    rows: np.ndarray


@lean_kernel
def add_monomials(table, g, grams, room, out):
    """Add to ``out`` a group's Gram matrices' coefficients of each monomial."""
    groups, base, shift, rows = table.groups, table.base, table.shift, table.rows
    square, q = groups[g, ORDER] ** 2, groups[g, PRODUCTS]
    first_base, first_shift = groups[g, BASE], groups[g, SHIFT]
    at, first = groups[g, FIRST_GRAM], groups[g, FIRST_MOMENT]
    for r in range(groups[g, ROWS]):
        for p in range(q):
            room[p] = 0.0
        for i in range(square):
            room[base[first_base + i]] += grams[at + i]
        at += square
        for c in range(rows.shape[1]):
            factor = rows[r, c]
            if factor != 0.0:
                for p in range(q):
                    out[first + shift[first_shift + c * q + p]] += factor * room[p]


@lean_kernel
def localize(table, g, moments, room, out):
    """Set ``out`` to the localizing matrices that a group's rows make of moments."""
    groups, base, shift, rows = table.groups, table.base, table.shift, table.rows
    square, q = groups[g, ORDER] ** 2, groups[g, PRODUCTS]
    first_base, first_shift = groups[g, BASE], groups[g, SHIFT]
    at, first = groups[g, FIRST_GRAM], groups[g, FIRST_MOMENT]
    for r in range(groups[g, ROWS]):
        for p in range(q):
            room[p] = 0.0
        for c in range(rows.shape[1]):
            factor = rows[r, c]
            if factor != 0.0:
                for p in range(q):
                    room[p] += factor * moments[first + shift[first_shift + c * q + p]]
        for i in range(square):
            out[at + i] = room[base[first_base + i]]
        at += square


@lean_kernel
def add_schur(table, g, grams, inverses, width, room, out):
    """Add ``<A_e, G A_f S^-1>`` to a group's system, whose rows are ``width`` long.

    A_e is the localizing matrices' coefficient of the moment e, ``inverses`` are those of S.
    """
    groups, base, shift, rows = table.groups, table.base, table.shift, table.rows
    m, q = groups[g, ORDER], groups[g, PRODUCTS]
    first_base, first_shift = groups[g, BASE], groups[g, SHIFT]
    at, first = groups[g, FIRST_GRAM], groups[g, FIRST_SYSTEM]
    for r in range(groups[g, ROWS]):
        for p in range(q * q):
            room[p] = 0.0
        for a in range(m):
            for c in range(m):
                value = grams[at + a * m + c]
                for b in range(m):
                    line = q * base[first_base + a * m + b]
                    for d in range(m):
                        product = value * inverses[at + b * m + d]
                        room[line + base[first_base + c * m + d]] += product
        at += m * m
        for c in range(rows.shape[1]):
            for d in range(rows.shape[1]):
                factor = rows[r, c] * rows[r, d]
                if factor != 0.0:
                    for p in range(q):
                        line = first + width * shift[first_shift + c * q + p]
                        for s in range(q):
                            e = shift[first_shift + d * q + s]
                            out[line + e] += factor * room[p * q + s]


@lean_kernel
def add_scaled(m, at, factor, grams, changes, inverses, room, out):
    """Add ``factor`` times the symmetric part of ``G D S^-1`` to a matrix of ``out``."""
    for a in range(m):
        for b in range(m):
            value = 0.0
            for c in range(m):
                value += grams[at + a * m + c] * changes[at + c * m + b]
            room[a * m + b] = value
    half = 0.5 * factor
    for a in range(m):
        for b in range(m):
            value = 0.0
            for c in range(m):
                value += room[a * m + c] * inverses[at + c * m + b]
            out[at + a * m + b] += half * value
            out[at + b * m + a] += half * value


@lean_kernel
def _factor(m, at, matrices, changes, step, lower):
    """Tell whether a matrix and its change times a step is positive definite.

    ``lower`` gets its factor (Cholesky).
    """
    for j in range(m):
        for i in range(j, m):
            value = matrices[at + i * m + j] + step * changes[at + i * m + j]
            for k in range(j):
                value -= lower[i * m + k] * lower[j * m + k]
            if i > j:
                lower[i * m + j] = value / lower[j * m + j]
            elif value > 0.0:
                lower[j * m + j] = np.sqrt(value)
            else:
                return False
    return True


@lean_kernel
def invert(m, at, matrices, room, out):
    """Set a matrix of ``out`` to the inverse of a positive definite one; False for others."""
    if not _factor(m, at, matrices, matrices, 0.0, room):
        return False
    inverse = m * m
    for j in range(m):
        room[inverse + j * m + j] = 1.0 / room[j * m + j]
        for i in range(j + 1, m):
            value = 0.0
            for k in range(j, i):
                value -= room[i * m + k] * room[inverse + k * m + j]
            room[inverse + i * m + j] = value / room[i * m + i]
    for i in range(m):
        for j in range(i + 1):
            value = 0.0
            for k in range(i, m):
                value += room[inverse + k * m + i] * room[inverse + k * m + j]
            out[at + i * m + j] = value
            out[at + j * m + i] = value
    return True


@lean_kernel
def longest_step(table, matrices, changes, step, room):
    """Return a step, at most ``step``, on which all matrices stay positive definite."""
    groups = table.groups
    for g in range(len(groups)):
        m, at = groups[g, ORDER], groups[g, FIRST_GRAM]
        for _ in range(groups[g, ROWS]):
            if not _factor(m, at, matrices, changes, step, room):
                short = 0.0
                for _ in range(_HALVINGS):
                    middle = 0.5 * (short + step)
                    if _factor(m, at, matrices, changes, middle, room):
                        short = middle
                    else:
                        step = middle
                step = short
            at += m * m
    return step
