"""Directions of locally least depth that EPA has found: rows of a workspace.

A row is the direction, the two witnesses, the depth (m), the stiffness of ``polish`` and the
features it was last reached from, as kind and point each.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = [
    "COLUMNS",
    "DEPTH",
    "FALLBACK",
    "MAX_MINIMA",
    "STIFFNESS",
    "best_minimum",
    "has_features",
    "nearby_minimum",
    "note_features",
    "store_minimum",
]

MAX_MINIMA = 16
"""Directions of locally least depth that are told apart; a ring of ties fills them."""

FALLBACK = MAX_MINIMA
"""The row of ``minima`` that holds the least extent seen so far, polished or not."""

DEPTH = 9
STIFFNESS = 10
FEATURES = 11
COLUMNS = 19


@lean_kernel
def store_minimum(minima, row, n, a, b, depth, stiffness):
    """Write a minimum: its direction n, witnesses, depth and stiffness."""
    for c in range(3):
        minima[row, c] = n[c]
        minima[row, 3 + c] = a[c]
        minima[row, 6 + c] = b[c]
    minima[row, DEPTH] = depth
    minima[row, STIFFNESS] = stiffness


@lean_kernel
def nearby_minimum(minima, found, n, cosine):
    """Return the row of the least known minimum within an angle of n, or -1."""
    nearby, depth = -1, math.inf
    for i in range(found):
        along = minima[i, 0] * n[0] + minima[i, 1] * n[1] + minima[i, 2] * n[2]
        if along > cosine and minima[i, DEPTH] < depth:
            nearby, depth = i, minima[i, DEPTH]
    return nearby


@lean_kernel
def best_minimum(minima, found, rounding):
    """Return the row of least depth; a polished one wins a tie with the fallback."""
    best = FALLBACK
    depth = minima[FALLBACK, DEPTH] + rounding
    for i in range(found):
        if minima[i, DEPTH] <= depth:
            best = i
            depth = minima[i, DEPTH]
    return best


@lean_kernel
def has_features(minima, row, feature_A, feature_B):
    """Return whether a minimum was last reached from these features."""
    return (
        minima[row, FEATURES] == feature_A[0]
        and minima[row, FEATURES + 4] == feature_B[0]
        and minima[row, FEATURES + 1] == feature_A[1][0]
        and minima[row, FEATURES + 2] == feature_A[1][1]
        and minima[row, FEATURES + 3] == feature_A[1][2]
        and minima[row, FEATURES + 5] == feature_B[1][0]
        and minima[row, FEATURES + 6] == feature_B[1][1]
        and minima[row, FEATURES + 7] == feature_B[1][2]
    )


@lean_kernel
def note_features(minima, row, feature_A, feature_B):
    """Write the features from which a minimum was reached."""
    minima[row, FEATURES] = feature_A[0]
    minima[row, FEATURES + 4] = feature_B[0]
    for c in range(3):
        minima[row, FEATURES + 1 + c] = feature_A[1][c]
        minima[row, FEATURES + 5 + c] = feature_B[1][c]
