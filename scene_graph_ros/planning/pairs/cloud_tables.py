"""The kernels' tables of robots' bodies among clouds that do not move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["CloudScratch", "CloudTable"]


class CloudTable(NamedTuple):
    """The kernels' table of m pairs of a robot's body and a cloud that does not move."""

    pairs: np.ndarray
    """``(m,)``: rows of the plan's pairs."""
    bodies: np.ndarray
    """``(m,)``: the robot's."""
    paddings: np.ndarray
    """``(m,)`` metres."""
    touching: np.ndarray
    """``(m,)`` metres."""
    groups: np.ndarray
    """``(g, 2)``: the first pair of bodies that are near to each other, and the one after them."""
    clouds: np.ndarray
    """``(c, 3)``: which cloud, its first group and the one after its last."""
    X_CW: np.ndarray
    """``(c, 3, 4)``: W in each cloud's frame."""
    X_WC: np.ndarray
    """``(c, 3, 4)``."""
    slacks: np.ndarray
    """``(c,)`` metres: what rounding is allowed."""
    counts: np.ndarray
    """``(c, (CELLS + 1)^3)``: of each cloud's grid."""
    moves: np.ndarray
    """``(c, CELLS^3)``: king's moves there from cells to the nearest that has points."""
    scales: np.ndarray
    """``(c, 3)``: cells per m along each axis."""
    plane_starts: np.ndarray
    """``(r + 1,)``: where the planes of each of the robots' bodies begin; none: its box is all."""
    planes: np.ndarray
    """``(p, 4)``: unit normals in G, out of the body, and how far out the plane is, m."""

    inner: np.ndarray
    """``(r, 4)`` m: half the edges of a box around the centre of each body's box, and the radius
    of a ball moved through it: all that is in the body. The radius is -inf where none is known."""


class CloudScratch(NamedTuple):
    """The scratch arrays of one thread."""

    X_CG: np.ndarray
    """``(r, 12, LANES)``: the robots' bodies in a cloud's frame."""
    boxes: np.ndarray
    """``(r, 6, LANES)``: centres and half extents there of boxes around them."""
    guesses: np.ndarray
    """``(r, 2)``: the plane of each that separated it from points last, and the leaf of points
    that was near to it last."""
