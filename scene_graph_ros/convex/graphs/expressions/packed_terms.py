"""Edges and sets as flat arrays, so that those of a path are one array each for kernels.

Whole numbers begin with how many there are and how many numbers there are, then sizes by the
columns below. An edge has behind them the kinds of its atoms, how many rows each has, how many
each cone, and the cones' kinds; its numbers are an estimate of its largest cost, its rows in the
variables of both sets and in their coordinates, constants, their rounding, and bounds of
rows. A set has a length, a variable of scale or -1 and the columns of each ball; its
numbers are its centre, half extents, a box's corners, S, and the rows of E, f, A and b.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

__all__ = [
    "AMBIENT",
    "ATOMS",
    "BALLS",
    "BOX",
    "BY_CORNERS",
    "CONES",
    "COORDINATES_U",
    "COORDINATES_V",
    "EDGE_HEAD",
    "EDGE_ROWS",
    "EQUATIONS",
    "INEQUALITIES",
    "NUMBERS",
    "OTHER",
    "REACH",
    "SET_EQUATIONS",
    "SET_HEAD",
    "SET_INEQUALITIES",
    "VARIABLES",
    "VARIABLES_U",
    "VARIABLES_V",
    "WHOLE",
    "Packed",
    "join",
    "packed",
]  # fmt: skip

WHOLE, NUMBERS = 0, 1
"""How many whole numbers and numbers an edge or a set has."""

(
    COORDINATES_U,
    COORDINATES_V,
    VARIABLES_U,
    VARIABLES_V,
    EDGE_ROWS,
    ATOMS,
    EQUATIONS,
    INEQUALITIES,
    CONES,
) = range(2, 11)

EDGE_HEAD = 11

AMBIENT, VARIABLES, REACH, SET_EQUATIONS, SET_INEQUALITIES, BALLS = range(2, 8)

SET_HEAD = 8

BOX, BY_CORNERS, OTHER = range(3)
"""How far a set reaches: as its box, as the corners that are the columns of S, or as it says."""


class Packed(NamedTuple):
    """Whole numbers and numbers, ``(k,)`` each."""

    whole: np.ndarray
    numbers: np.ndarray


def packed(head: list[int], rest: list[int], arrays: list[np.ndarray]) -> list[Packed]:
    """Return the array that begins with ``head``, sets' or edges' sizes, behind counts of both.

    ``arrays`` have an entry for each of these, which are alike but for their numbers.
    """
    numbers = np.concatenate([each.reshape(len(each), -1) for each in arrays], axis=1)
    counts = [2 + len(head) + len(rest), numbers.shape[1]]
    whole = np.array([*counts, *head, *rest], dtype=np.int64)
    return [Packed(whole, each) for each in numbers]


def join(some: Sequence[Packed]) -> Packed:
    """Return edges, or sets, one behind another."""
    none = Packed(np.zeros(0, dtype=np.int64), np.zeros(0))
    return Packed(*(np.concatenate(each) for each in zip(none, *some, strict=True)))
