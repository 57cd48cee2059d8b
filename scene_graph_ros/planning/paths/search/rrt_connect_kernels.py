"""Two trees of proven edges that grow towards each other.

RRT-Connect (Kuffner and LaValle, *RRT-Connect: An Efficient Approach to Single-Query Path
Planning*, 2000, section 2): the smaller tree takes a step towards a random configuration, then the
other one walks towards where that led as far as it comes. Here one edge is proposed at a time;
the caller proves it and returns the outcome.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.planning.paths.search.search_state import (
    CONNECT,
    DONE,
    EXTEND,
    JOINED,
    NEAR,
    NEEDS_ROOM,
    NEEDS_SAMPLES,
    PHASE,
    PROVE,
    REACHES,
    ROOTS,
    SAMPLE,
    TARGET,
    TREE,
)
from scene_graph_ros.planning.paths.search.space_kernels import distance, nearest, walk

__all__ = ["Trees", "propose_growth", "take_growth"]


class Trees(NamedTuple):
    """The trees from start and goals; those of all goals share their rows, each has a root."""

    nodes: np.ndarray
    """``(2, n, nq)``."""
    parents: np.ndarray
    """``(2, n)``: -1 for roots."""
    sizes: np.ndarray
    """``(2,)``."""
    gap: np.ndarray
    """``(1,)``: how near the trees came to each other."""


@inlined_kernel
def propose_growth(tree, space, trees, samples, longest, state, edge):
    """Write the next edge to the first two rows of ``edge`` ``(3, nq)``; return an answer."""
    phase, a = state[PHASE], state[TREE]
    if phase == JOINED:
        return DONE
    if max(trees.sizes[0], trees.sizes[1]) >= trees.nodes.shape[1]:
        return NEEDS_ROOM
    if phase == EXTEND:
        if state[SAMPLE] >= len(samples):
            return NEEDS_SAMPLES
        target = samples[state[SAMPLE]]
        near, far = nearest(space, trees.nodes[a], trees.sizes[a], target)
        step = longest
        state[NEAR] = near
    else:
        near, target = state[NEAR], trees.nodes[1 - a, state[TARGET]]
        far = distance(space, trees.nodes[a, near], target)
        step = math.inf if state[ROOTS] > 0 else longest
        trees.gap[0] = min(trees.gap[0], far)
    state[REACHES] = 1 if far <= step else 0
    t = 1.0 if far <= step else step / far
    for i in range(edge.shape[1]):
        edge[0, i] = trees.nodes[a, near, i]
    walk(tree, space, edge[0], target, t, edge[2], edge[1])
    return PROVE


@inlined_kernel
def _add(trees, a, q, parent):
    """Add a node to a tree and return its row."""
    row = trees.sizes[a]
    for i in range(len(q)):
        trees.nodes[a, row, i] = q[i]
    trees.parents[a, row] = parent
    trees.sizes[a] = row + 1
    return row


@inlined_kernel
def _next_sample(trees, state):
    """Let the smaller tree step to the next sample."""
    state[PHASE] = EXTEND
    state[TREE] = 0 if trees.sizes[0] <= trees.sizes[1] else 1


@inlined_kernel
def take_growth(space, trees, state, edge, is_free):
    """Take the outcome of the edge that was proposed."""
    a, near = state[TREE], state[NEAR]
    if state[PHASE] == EXTEND:
        state[SAMPLE] += 1
        if not is_free:
            _next_sample(trees, state)
            return
        row = _add(trees, a, edge[1], near)
        other, _ = nearest(space, trees.nodes[1 - a], trees.sizes[1 - a], edge[1])
        state[PHASE], state[TREE] = CONNECT, 1 - a
        state[NEAR], state[TARGET] = other, row
        return
    if is_free:
        state[NEAR] = _add(trees, a, edge[1], near)
        if state[REACHES] != 0:
            state[PHASE] = JOINED
    elif state[ROOTS] > 1:
        state[ROOTS] -= 1
        state[NEAR] += 1
    else:
        state[ROOTS] = 0
        _next_sample(trees, state)
