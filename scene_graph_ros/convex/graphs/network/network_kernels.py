"""Edges of a network that can be on a simple path, few such paths, vertices on circles.

Networks are edges ``tails (m,)`` to ``heads (m,)`` among ``size`` vertices; ``is_kept (m,)`` says
which of them are there.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["edges_on_simple_paths", "few_simple_paths", "strong_components"]


@kernel
def _listed(size, ends, is_kept):
    """Return the kept edges in order of their ``ends``, and where each vertex's begin."""
    first = np.zeros(size + 1, np.int64)
    for e in range(len(ends)):
        if is_kept[e]:
            first[ends[e] + 1] += 1
    for v in range(size):
        first[v + 1] += first[v]
    at, edges = first[:-1].copy(), np.zeros(first[size], np.int64)
    for e in range(len(ends)):
        if is_kept[e]:
            edges[at[ends[e]]] = e
            at[ends[e]] += 1
    return edges, first


@kernel
def _keep_block(size, tails, heads, source, target, is_kept):
    """Keep edges that are in one block with an edge from source to target.

    A block is a part that no single vertex cuts (Hopcroft and Tarjan, "Algorithm 447", 1973);
    these are the edges of simple paths of an undirected graph.
    """
    out, out_first = _listed(size, tails, is_kept)
    back, back_first = _listed(size, heads, is_kept)
    depth, low = np.full(size, -1), np.zeros(size, np.int64)
    came_by, looked = np.full(size, -1), np.zeros(size, np.int64)
    stack, passed = np.zeros(size, np.int64), np.zeros(len(tails), np.int64)
    is_kept[:] = False
    # Depth first from the target, to which the first edge leads from the source.
    depth[source], depth[target] = 0, 1
    stack[0], top, count = target, 0, 0
    while top >= 0:
        v = stack[top]
        number = out_first[v + 1] - out_first[v]
        if looked[v] < number + back_first[v + 1] - back_first[v]:
            if looked[v] < number:
                e = out[out_first[v] + looked[v]]
                w = heads[e]
            else:
                e = back[back_first[v] + looked[v] - number]
                w = tails[e]
            looked[v] += 1
            if e == came_by[v]:
                continue
            if depth[w] < 0:
                passed[count] = e
                count += 1
                top += 1
                depth[w], low[w], came_by[w], stack[top] = top + 1, top + 1, e, w
            elif depth[w] < depth[v]:
                passed[count] = e
                count += 1
                low[v] = min(low[v], depth[w])
            continue
        top -= 1
        if top < 0:
            break
        u = stack[top]
        low[u] = min(low[u], low[v])
        if low[v] >= depth[u]:
            # What is beyond u is a block of its own.
            count -= 1
            while passed[count] != came_by[v]:
                count -= 1
    for i in range(count):
        is_kept[passed[i]] = True


@kernel
def _immediate_dominators(tails, into, into_first, order, rank):
    """Return the immediate dominators of ranks in a postorder, of which the root has the last."""
    count = len(order)
    above = np.full(count, -1)
    above[count - 1] = count - 1
    is_changed = True
    while is_changed:
        is_changed = False
        for r in range(count - 2, -1, -1):
            new = -1
            for k in range(into_first[order[r]], into_first[order[r] + 1]):
                u = rank[tails[into[k]]]
                if u < 0 or above[u] < 0:
                    continue
                if new < 0:
                    new = u
                while u != new:
                    if u < new:
                        u = above[u]
                    else:
                        new = above[new]
            if above[r] != new:
                above[r] = new
                is_changed = True
    return above


@kernel
def _tree_of_dominators(size, root, heads, tails, is_kept):
    """Return when a walk of the tree enters each vertex, -1 if it never does, and the last below.

    Of vertices reached from the root along edges ``tails`` to ``heads`` (Cooper, Harvey and
    Kennedy, "A simple, fast dominance algorithm", 2001).
    """
    out, out_first = _listed(size, tails, is_kept)
    into, into_first = _listed(size, heads, is_kept)
    order, rank = np.zeros(size, np.int64), np.full(size, -1)
    stack, looked, is_seen = np.zeros(size, np.int64), out_first[:-1].copy(), np.zeros(size)
    stack[0], top, count, is_seen[root] = root, 0, 0, 1.0
    while top >= 0:
        v = stack[top]
        if looked[v] < out_first[v + 1]:
            w = heads[out[looked[v]]]
            looked[v] += 1
            if is_seen[w] == 0.0:
                is_seen[w] = 1.0
                top += 1
                stack[top] = w
            continue
        order[count], rank[v] = v, count
        count += 1
        top -= 1
    above = _immediate_dominators(tails, into, into_first, order[:count], rank)
    # Ranks below come before those above: sizes of what is below, then places in the walk.
    below = np.ones(size, np.int64)
    for r in range(count - 1):
        below[above[r]] += below[r]
    first, last, room = np.full(size, -1), np.full(size, -1), np.zeros(size, np.int64)
    for r in range(count - 1, -1, -1):
        v = order[r]
        if r < count - 1:
            parent = order[above[r]]
            first[v] = room[parent]
            room[parent] += below[r]
        else:
            first[v] = 0
        last[v] = first[v] + below[r] - 1
        room[v] = first[v] + 1
    return first, last


@lean_kernel
def _dominates(first, last, v, u):
    """Tell whether all ways from the root to u lead through v."""
    return first[v] >= 0 and first[v] <= first[u] <= last[v]


@kernel
def edges_on_simple_paths(size, tails, heads, source, target):
    """Return edges ``(k,)`` without those that are seen to be on no simple path."""
    is_kept = np.ones(len(tails), np.bool_)
    _keep_block(size, tails, heads, source, target, is_kept)
    ahead, last_ahead = _tree_of_dominators(size, source, heads, tails, is_kept)
    back, last_back = _tree_of_dominators(size, target, tails, heads, is_kept)
    for e in range(len(tails)):
        u, v = tails[e], heads[e]
        is_kept[e] = (
            is_kept[e]
            and v != source
            and u != target
            and ahead[u] >= 0
            and back[v] >= 0
            and not _dominates(ahead, last_ahead, v, u)
            and not _dominates(back, last_back, u, v)
        )
    _keep_block(size, tails, heads, source, target, is_kept)
    return np.flatnonzero(is_kept)


@kernel
def few_simple_paths(size, tails, heads, source, target, most_looks, most_edges):
    """Return the edges of all simple paths, one path behind another, and where each ends.

    And whether these are all: there are too many where looking at ``most_looks`` edges does not
    find them, or where they have more than ``most_edges`` together.
    """
    out, first = _listed(size, tails, np.ones(len(tails), np.bool_))
    edges, ends = np.zeros(most_edges, np.int64), np.zeros(most_edges, np.int64)
    total, count, top, looked = 0, 0, 0, first[:-1].copy()
    stack, path, is_on = np.zeros(size, np.int64), np.zeros(size, np.int64), np.zeros(size)
    stack[0], is_on[source] = source, 1.0
    for _ in range(most_looks):
        v = stack[top]
        if looked[v] == first[v + 1]:
            looked[v], is_on[v] = first[v], 0.0
            top -= 1
            if top < 0:
                return edges[:total], ends[:count], True
            continue
        e = out[looked[v]]
        looked[v] += 1
        w = heads[e]
        if w == target:
            if total + top + 1 > most_edges:
                break
            for i in range(top):
                edges[total + i] = path[i]
            edges[total + top] = e
            total += top + 1
            ends[count] = total
            count += 1
        elif is_on[w] == 0.0:
            path[top] = e
            top += 1
            stack[top], is_on[w] = w, 1.0
    return edges[:0], ends[:0], False


@kernel
def strong_components(size, tails, heads):
    """Return a number for each vertex ``(size,)``: the same for those that reach each other.

    Tarjan, "Depth-first search and linear graph algorithms", 1972.
    """
    out, first = _listed(size, tails, np.ones(len(tails), np.bool_))
    found, entered = np.full(size, -1), np.full(size, -1)
    low, looked = np.zeros(size, np.int64), first[:-1].copy()
    path, open_ = np.zeros(size, np.int64), np.zeros(size, np.int64)
    count, number, last = 0, 0, 0
    for root in range(size):
        if entered[root] >= 0:
            continue
        top = 0
        path[0] = root
        while top >= 0:
            v = path[top]
            if entered[v] < 0:
                entered[v], low[v] = count, count
                count += 1
                open_[last] = v
                last += 1
            if looked[v] < first[v + 1]:
                w = heads[out[looked[v]]]
                looked[v] += 1
                if entered[w] < 0:
                    top += 1
                    path[top] = w
                elif found[w] < 0:
                    low[v] = min(low[v], entered[w])
                continue
            top -= 1
            if top >= 0:
                low[path[top]] = min(low[path[top]], low[v])
            if low[v] == entered[v]:
                # What is open since v is what v reaches and is reached from.
                while found[v] < 0:
                    last -= 1
                    found[open_[last]] = number
                number += 1
    return found
