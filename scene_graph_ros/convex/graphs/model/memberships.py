"""The membership of variables in a set, as rows of a program; of many sets at once."""

from __future__ import annotations

from collections.abc import Sequence
import functools
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram

__all__ = ["Membership", "add_memberships", "membership_of_box"]


class Membership(NamedTuple):
    """Entries of rows, their constants, and the variable of a ball's scale or -1."""

    cone: Cone
    i: np.ndarray
    j: np.ndarray
    values: np.ndarray
    side: np.ndarray
    ball: int = -1


def add_memberships(
    program: ConeProgram,
    asked: Sequence[tuple[Membership, ...]],
    firsts: np.ndarray,
    scales: np.ndarray | None,
) -> None:
    """Add the membership of variables in their sets; of each set the first is given ``(m,)``.

    The others follow it. Sets are ``scales`` times as large, variables ``(m,)``, where these are
    given.
    """
    alike: dict[int, list[int]] = {}
    for k, each in enumerate(asked):
        if each:
            alike.setdefault(id(each), []).append(k)
    for some in alike.values():
        _add_memberships(
            program, asked[some[0]], firsts[some], None if scales is None else scales[some]
        )


def _add_memberships(
    program: ConeProgram,
    asked: Sequence[Membership],
    firsts: np.ndarray,
    scales: np.ndarray | None,
) -> None:
    """Ask the same of many sets' variables."""
    count = len(firsts)
    for each in asked:
        m = len(each.side)
        row = m * np.arange(count)[:, None]
        columns = (firsts[:, None] + each.j).ravel()
        entries = [((row + each.i).ravel(), columns, np.tile(each.values, count))]
        constant = np.zeros(m * count)
        if each.ball >= 0:
            entries.append((row[:, 0], firsts + each.ball, np.ones(count)))
        elif scales is None:
            constant = np.tile(each.side, count)
        else:
            at = np.flatnonzero(each.side)
            places = (row + at).ravel()
            entries.append((places, np.repeat(scales, len(at)), np.tile(each.side[at], count)))
        program.add_entries(each.cone, entries, constant, [m] * count)


@functools.lru_cache
def membership_of_box(k: int) -> tuple[Membership, ...]:
    """Return the membership of k variables from -1 to 1; the same object each time."""
    if not k:
        return ()
    i, j = np.arange(2 * k), np.tile(np.arange(k), 2)
    values = np.repeat([-1.0, 1.0], k)
    return (Membership(Cone.NONNEGATIVE, i, j, values, np.ones(2 * k)),)
