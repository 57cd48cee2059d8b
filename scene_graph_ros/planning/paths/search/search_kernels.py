"""The search for a path, and for a shorter one: edges are proposed, proven and taken, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.planning.edges.edge_kernels import prove_edge
from scene_graph_ros.planning.edges.edge_stretches import FREE, UNFINISHED
from scene_graph_ros.planning.pairs.bodies import place_static_bodies
from scene_graph_ros.planning.paths.search.rrt_connect_kernels import (
    propose_growth,
    take_growth,
    Trees,
)
from scene_graph_ros.planning.paths.search.search_state import (
    EDGES,
    LOOKS,
    PAUSED,
    PHASE,
    PROVE,
    SHORTEN,
    STOPPED,
)
from scene_graph_ros.planning.paths.search.shortcut_kernels import (
    Corners,
    propose_shortcut,
    take_shortcut,
)
from scene_graph_ros.planning.paths.search.space_kernels import SpaceTable

__all__ = ["SearchTables", "search"]


class SearchTables(NamedTuple):
    """The nodes that a search has found so far, and its next try."""

    space: SpaceTable
    longest: float
    """rad and m: the longest step of a tree."""
    trees: Trees
    path: Corners
    samples: np.ndarray
    """``(n, nq)``: random configurations."""
    state: np.ndarray
    """``(ENTRIES,)``: see ``search_state``."""
    edge: np.ndarray
    """``(3, nq)``: the ends of an edge to be proven, and room for one more."""
    numbers: np.ndarray
    """``(4,)``: what a proof tells of it."""


@lean_kernel
def search(checked, rules, stop, grown, scratch):
    """Go on with a search until something is missing, or all is done; return which.

    ``checked`` is a ``CheckedTables``, ``grown`` a ``SearchTables``. An edge that was being proven
    when ``stop`` was set, or that was not finished after its looks, is dropped. The rest
    does not depend on where calls began and ended.
    """
    tree = checked.tree
    space, longest, trees, path, samples, state, edge, numbers = grown
    place_static_bodies(checked.bodies, scratch.places)
    while True:
        is_growing = state[PHASE] != SHORTEN
        if is_growing:
            answer = propose_growth(tree, space, trees, samples, longest, state, edge)
        else:
            answer = propose_shortcut(tree, space, path, state, edge)
        if answer != PROVE:
            return answer
        status, _ = prove_edge(checked, edge[:2], rules, stop, scratch, numbers)
        if status == UNFINISHED:
            return PAUSED
        if stop[0] != 0:
            return STOPPED
        state[EDGES] += 1
        state[LOOKS] -= numbers[3]
        if is_growing:
            take_growth(space, trees, state, edge, status == FREE)
        else:
            take_shortcut(path, state, edge, status == FREE)
        if state[LOOKS] <= 0:
            return PAUSED
