"""Proofs that edges keep their distance from clouds that do not move, by yes or no.

A body is free on a stretch where no ball is nearer to it in the middle than its points can move
until the ends, beside its padding. Where that is not so the stretch is halved, for this body
alone, until a configuration in the middle collides. Unproven edges are left to the
proofs of all other pairs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import load_lanes
from scene_graph_ros.geometry.query.elements.element_places import tree_of
from scene_graph_ros.planning.edges.curve_kernels import point_on
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, FREE, UNDECIDED
from scene_graph_ros.planning.edges.motion_kernels import margin_of, Motions, set_body_motions
from scene_graph_ros.planning.pairs.bodies import place_bodies, Places
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.cloud_grid import lanes_near, may_be_near
from scene_graph_ros.planning.pairs.cloud_kernels import (
    body_in_cloud,
    box_of,
    box_of_lanes,
    joined_lanes,
    place_in_cloud,
)
from scene_graph_ros.planning.pairs.cloud_scan import any_near
from scene_graph_ros.planning.pairs.cloud_tables import CloudScratch
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["MOST_WAITING", "CloudEdgeScratch", "prove_clouds"]

MOST_WAITING = 512
"""Stretches that wait; an edge that needs more is left undecided."""

_STRETCH = 0.15
"""Metres that bodies move on a stretch that is looked at first."""

_FINEST = 1e-6
"""Of an edge: shorter stretches are not halved."""


class CloudEdgeScratch(NamedTuple):
    """The scratch arrays of one thread."""

    motions: Motions
    places: Places
    clouds: CloudScratch
    ends: np.ndarray
    """``(MOST_WAITING, 2)``: the stretches that wait."""
    open: np.ndarray
    """``(MOST_WAITING + LANES, m)`` bool: which pairs are not proven on each; the last are those
    that are looked at."""
    low: np.ndarray
    """``(LANES,)``: where stretches begin that are looked at."""
    high: np.ndarray
    """``(LANES,)``."""
    near: np.ndarray
    """``(g,)``: bits of those on which each group of the table's pairs may be near to balls."""


@inlined_kernel
def _needs(table, motions, c, m, half, tolerance):
    """Return the distance of balls from which a pair is free on a stretch, m."""
    own = motions.own[table.bodies[m]]
    return half * own[0] + table.paddings[m] + margin_of(own[2]) + tolerance + table.slacks[c]


@inlined_kernel
def _lanes_of_group(table, scratch, tree, c, group, tolerance, bits):
    """Return those of the bits of stretches on which a group may be near to balls."""
    motions, clouds, first = scratch.motions, scratch.clouds, table.groups[group, 0]
    half = (load_lanes(scratch.high, 0) - load_lanes(scratch.low, 0)) * 0.5
    need = _needs(table, motions, c, first, half, tolerance)
    box = box_of_lanes(clouds, table.bodies[first], need)
    for m in range(first + 1, table.groups[group, 1]):
        need = _needs(table, motions, c, m, half, tolerance)
        box = joined_lanes(box, box_of_lanes(clouds, table.bodies[m], need))
    return lanes_near(tree, table, c, box[0], box[1], bits)


@inlined_kernel
def _look_at_group(checked, table, scratch, tree, c, group, k, half, tolerance, is_open):
    """Mark the pairs of a group that are free on stretch k.

    Returns one that collides in the middle, or NO_PAIR, and whether any is still open.
    """
    motions, places, clouds = scratch.motions, scratch.places, scratch.clouds
    held, bodies = checked.held, checked.bodies
    any_open = False
    for m in range(table.groups[group, 0], table.groups[group, 1]):
        if not is_open[m]:
            continue
        a, need = table.bodies[m], _needs(table, motions, c, m, half, tolerance)
        lower, upper = box_of(clouds, a, k, need)
        if not may_be_near(tree, table, c, lower, upper):
            is_open[m] = False
            continue
        body, where = body_in_cloud(bodies, table, clouds, a, k), (places, table, c, k)
        limit = table.paddings[m] - table.touching[m]
        guesses = clouds.guesses
        if not any_near(held, tree, body, where, need, limit, False, guesses, a):
            is_open[m] = False
            continue
        any_open = True
        need = table.paddings[m] + table.slacks[c]
        lower, upper = box_of(clouds, a, k, need)
        if not may_be_near(tree, table, c, lower, upper):
            continue
        if any_near(held, tree, body, where, need, limit, True, guesses, a):
            return table.pairs[m], True
    return NO_PAIR, any_open


@inlined_kernel
def _put(scratch, count, low, high, row):
    """Put a stretch on the pile with the open pairs of a row that is looked at."""
    scratch.ends[count, 0], scratch.ends[count, 1] = low, high
    for m in range(scratch.open.shape[1]):
        scratch.open[count, m] = scratch.open[row, m]
    return count + 1


@inlined_kernel
def _put_first(checked, scratch):
    """Put an edge in stretches of some length on the pile; return how many."""
    longest, own = 0.0, scratch.motions.own
    for a in range(len(own)):
        longest = max(longest, own[a, 0])
    parts, waiting = int(min(1.0 + longest / _STRETCH, 64.0)), 0
    for m in range(scratch.open.shape[1]):
        scratch.open[MOST_WAITING, m] = True
    for i in range(parts):
        waiting = _put(scratch, waiting, i / parts, (i + 1) / parts, MOST_WAITING)
    return waiting


@inlined_kernel
def _place_last(checked, edge, scratch, waiting, count):
    """Place bodies as in the middles of the last stretches on the pile."""
    motions, last = scratch.motions, scratch.open.shape[1] - 1
    for k in range(LANES):
        row = waiting - 1 - min(k, count - 1)
        low, high = scratch.ends[row, 0], scratch.ends[row, 1]
        scratch.low[k], scratch.high[k] = low, high
        for m in range(last if k < count else 0):
            scratch.open[MOST_WAITING + k, m] = scratch.open[row, m]
        scratch.open[MOST_WAITING + k, last] = False
        point_on(checked.tree, edge, 0.5 * (low + high), motions.q[k])
    place_bodies(checked.tree, checked.bodies, motions.q, 0, checked.X_WB, scratch.places)


@inlined_kernel
def _open_lanes(scratch, first, end, count):
    """Return the bits of stretches on which any of these pairs is open."""
    bits = 0
    for k in range(count):
        for m in range(first, end):
            if scratch.open[MOST_WAITING + k, m]:
                bits |= 1 << k
    return bits


@inlined_kernel
def _look(checked, table, scratch, count, tolerance):
    """Find pairs that are free on stretches; return (pair, lane) of a collision, if any."""
    last = scratch.open.shape[1] - 1
    for c in range(len(table.clouds)):
        place_in_cloud(checked.bodies, scratch.places, table.X_CW[c], scratch.clouds)
        tree = tree_of(checked.held, table.clouds[c, 0])
        groups = range(table.clouds[c, 1], table.clouds[c, 2])
        for group in groups:
            bits = _open_lanes(scratch, table.groups[group, 0], table.groups[group, 1], count)
            if bits != 0:
                bits = _lanes_of_group(table, scratch, tree, c, group, tolerance, bits)
            scratch.near[group] = bits
        for k in range(count):
            is_open, half = (
                scratch.open[MOST_WAITING + k],
                0.5 * (scratch.high[k] - scratch.low[k]),
            )
            for group in groups:
                if scratch.near[group] >> k & 1 == 0:
                    for m in range(table.groups[group, 0], table.groups[group, 1]):
                        is_open[m] = False
                    continue
                pair, any_open = _look_at_group(
                    checked, table, scratch, tree, c, group, k, half, tolerance, is_open
                )
                if pair != NO_PAIR:
                    return pair, k
                is_open[last] |= any_open
    return NO_PAIR, 0


@inlined_kernel
def _prove(checked, table, edge, rules, stop, scratch):
    """Return (status, pair, at, looks) of one edge."""
    set_body_motions(checked.tree, checked.bodies, checked.reaches, edge, scratch.motions)
    waiting, looks, last = _put_first(checked, scratch), 0, scratch.open.shape[1] - 1
    while waiting > 0:
        count = min(LANES, waiting)
        _place_last(checked, edge, scratch, waiting, count)
        waiting -= count
        looks += count
        pair, k = _look(checked, table, scratch, count, rules.tolerance)
        if pair != NO_PAIR:
            return COLLIDES, pair, 0.5 * (scratch.low[k] + scratch.high[k]), looks
        for k in range(count):
            if not scratch.open[MOST_WAITING + k, last]:
                continue
            low, high = scratch.low[k], scratch.high[k]
            if high - low < _FINEST or waiting + 2 > MOST_WAITING or stop[0] != 0:
                return UNDECIDED, NO_PAIR, low, looks
            middle = 0.5 * (low + high)
            waiting = _put(scratch, waiting, low, middle, MOST_WAITING + k)
            waiting = _put(scratch, waiting, middle, high, MOST_WAITING + k)
    return FREE, NO_PAIR, 1.0, looks


@lean_kernel
def prove_clouds(checked, table, edges, rules, stop, proofs, scratch):
    """Prove those of some edges that are FREE by now to be so of clouds as well.

    Writes COLLIDES with the pair and where, or UNDECIDED, for others.
    """
    statuses, numbers, found = proofs
    for e in range(len(edges)):
        if statuses[e] != FREE:
            continue
        status, pair, at, looks = _prove(checked, table, edges[e], rules, stop, scratch)
        statuses[e], found[e] = status, pair
        numbers[e, 2] = 0.0
        numbers[e, 3] += looks
        if status != FREE:
            numbers[e, 0] = numbers[e, 1] = at
