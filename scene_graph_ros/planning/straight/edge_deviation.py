"""How far a tool is from its way at most, while joints go straight between two points of it.

Along a straight edge v of a chain the tool's origin p has ``p'' = sum over i, j of v_i v_j d_ij``,
with its second derivatives d. That of two joints that turn, i before j, is ``a_i x (a_j x (p -
o_j))``: at most the distance from joint j to the tool. That of one that turns and a later one that
slides is at most 1, and all others are zero. A curve is off its chord by at most an eighth of the
largest second derivative. Likewise the angular velocity changes by at most ``|v_i v_j|``, summed
over pairs i < j of joints that turn. So the turn is off the one at constant velocity by an eighth
of that, and that is off the turn from end to end by as much, or a little more, as geodesics of
rotations are not parallel: less than 4 % for turns of at most half a radian. A floating joint's
origin goes straight and it turns about one axis, so it counts as one joint that turns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.ik.tool_chain import ToolChain

__all__ = ["edge_deviations"]

_TURNS = 0.26
"""Twice an eighth, and 4 % more."""


def edge_deviations(
    chain: ToolChain, x1: NDArray[np.float64], x2: NDArray[np.float64]
) -> tuple[float, float]:
    """Return bounds, m and rad, for an edge between coordinates ``(n,)`` whose ends are right."""
    table = chain.table
    if not len(x1):
        return 0.0, 0.0
    columns = np.maximum(table.columns, 0)
    ends = np.abs(np.stack([x1, x2])[:, columns] * table.multipliers + table.offsets)
    (changes,) = chain.changes(x1[np.newaxis], x2[np.newaxis])
    rates = np.where(table.columns >= 0, np.abs(changes[columns] * table.multipliers), 0.0)
    # From each joint to the tool: the parts of the chain after it, and as far as these slide.
    slid = np.where(table.slides, ends.max(axis=0), 0.0)
    parts = np.sqrt((table.places[1:] ** 2).sum(axis=1)) + slid
    arms = np.cumsum(parts[::-1])[::-1]
    turns, slides = np.where(table.slides, 0.0, rates), np.where(table.slides, rates, 0.0)
    before = np.cumsum(turns) - turns
    bent = (2.0 * before * (turns * arms + slides) + turns**2 * arms).sum()
    turned = (before * turns).sum()
    return float(chain.unit * bent / 8.0), float(_TURNS * turned)
