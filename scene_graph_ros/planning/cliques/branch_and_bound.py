"""A largest clique by branch and bound on bitsets.

San Segundo, Rodriguez-Losada and Jimenez, "An exact bit-parallel algorithm for the maximum clique
problem", Computers & Operations Research 38, 2011: vertices in the order of least degree; a greedy
colouring of the candidates bounds the size of a branch's cliques, as a clique has one vertex of a
colour.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["largest_clique"]

_BITS = 62
"""Of a word: so many that a signed one is never negative."""

_STEPS = 20_000
"""Branches between looks at the clock: some hundredths of a second."""


class _Branches(NamedTuple):
    """Where a search is; rows by how many vertices the clique has by then."""

    candidates: NDArray[np.int64]
    """``(n + 1, words)``: bits of the vertices that may still join."""
    colored: NDArray[np.int64]
    """``(n + 1, n)``: vertices to branch on, by their colours."""
    colors: NDArray[np.int64]
    left: NDArray[np.int64]
    """``(n + 1,)``: how many of them are left, -1 where they are not yet coloured."""
    stack: NDArray[np.int64]
    """``(n,)``: the clique's vertices."""
    best: NDArray[np.int64]
    """``(n,)``: those of the largest clique so far."""
    sizes: NDArray[np.int64]
    """How many vertices the clique has, and the largest one."""
    is_new: NDArray[np.int64]
    """Whether that was found here."""


def largest_clique(
    adjacent: NDArray[np.bool_], clique: NDArray[np.bool_], deadline: float | None
) -> tuple[NDArray[np.bool_], bool]:
    """Return a largest clique ``(n,)``, or the largest until ``deadline``, and whether it is one.

    ``adjacent (n, n)`` is symmetric with zeros on the diagonal, n at least 1; ``clique`` is one to
    begin with, and ``deadline`` is on ``time.monotonic``.
    """
    n = len(adjacent)
    order = _degeneracy_order(adjacent)
    words = (n + _BITS - 1) // _BITS
    rows = _bitsets(adjacent[np.ix_(order, order)])
    # One row for each vertex that may be in the clique.
    candidates = np.zeros((n + 1, words), dtype=np.int64)
    candidates[0] = _bitsets(np.ones((1, n), dtype=np.bool_))[0]
    colored, colors = np.zeros((2, n + 1, n), dtype=np.int64)
    left = np.full(n + 1, -1, dtype=np.int64)
    stack, best = np.zeros((2, n), dtype=np.int64)
    sizes = np.array([0, int(clique.sum())], dtype=np.int64)
    is_new = np.zeros(1, dtype=np.int64)
    branches = _Branches(candidates, colored, colors, left, stack, best, sizes, is_new)
    scratch = np.zeros((2, words), dtype=np.int64)
    is_done = False
    while not is_done:
        is_done = bool(_search(rows, branches, scratch, _STEPS))
        if deadline is not None and time.monotonic() > deadline:
            break
    if not is_new[0]:
        return clique, is_done
    found = np.zeros(n, dtype=np.bool_)
    found[order[best[: sizes[1]]]] = True
    return found, is_done


def _degeneracy_order(adjacent: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return vertices so that the last has the least degree, and so on of those before it."""
    degrees = adjacent.sum(axis=1)
    left = np.ones(len(adjacent), dtype=np.bool_)
    order = np.empty(len(adjacent), dtype=np.intp)
    for place in range(len(adjacent) - 1, -1, -1):
        vertex = int(np.argmin(np.where(left, degrees, len(adjacent) + 1)))
        order[place], left[vertex] = vertex, False
        degrees = degrees - adjacent[vertex]
    return order


def _bitsets(rows: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return rows of bool ``(m, n)`` as bits of words ``(m, words)``."""
    m, n = rows.shape
    words = (n + _BITS - 1) // _BITS
    padded = np.zeros((m, words * _BITS), dtype=np.int64)
    padded[:, :n] = rows
    shifts = np.arange(_BITS, dtype=np.int64)
    return (padded.reshape(m, words, _BITS) << shifts).sum(axis=2)


@kernel
def _first_bit(word):
    """Return the place of the lowest bit of a word that is not zero."""
    return math.frexp(float(word & -word))[1] - 1


@kernel
def _color(rows, candidates, order, colors, least, uncolored, independent):
    """Colour candidates greedily; list those whose colour is above ``least``; return how many.

    Vertices of one colour are not adjacent. ``uncolored``, ``independent (words,)`` are scratch.
    """
    words = len(candidates)
    uncolored[:] = candidates
    count, color = 0, 0
    while uncolored.any():
        color += 1
        independent[:] = uncolored
        for w in range(words):
            while independent[w]:
                bit = _first_bit(independent[w])
                vertex = w * _BITS + bit
                uncolored[w] &= ~(np.int64(1) << bit)
                independent[w] &= ~(np.int64(1) << bit)
                for other in range(w, words):
                    independent[other] &= ~rows[vertex, other]
                if color > least:
                    order[count], colors[count] = vertex, color
                    count += 1
    return count


@kernel
def _search(rows, branches, scratch, most_steps):
    """Take some branches; return whether all are done."""
    candidates, colored, colors, left, stack, best, sizes, is_new = branches
    for _ in range(most_steps):
        depth = sizes[0]
        if left[depth] < 0:
            left[depth] = _color(
                rows,
                candidates[depth],
                colored[depth],
                colors[depth],
                sizes[1] - depth,
                scratch[0],
                scratch[1],
            )
        k = left[depth] - 1
        if k < 0 or colors[depth, k] + depth <= sizes[1]:
            left[depth] = -1
            if depth == 0:
                return True
            sizes[0] -= 1
            continue
        vertex = colored[depth, k]
        left[depth] = k
        word, bit = vertex // _BITS, vertex % _BITS
        candidates[depth, word] &= ~(np.int64(1) << bit)
        stack[depth] = vertex
        candidates[depth + 1] = candidates[depth] & rows[vertex]
        if candidates[depth + 1].any():
            left[depth + 1] = -1
            sizes[0] = depth + 1
        elif depth + 1 > sizes[1]:
            sizes[1] = depth + 1
            best[: depth + 1] = stack[: depth + 1]
            is_new[0] = 1
    return False
