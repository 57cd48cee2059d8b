"""The search for a path, and for a shorter one: edges are proposed, proven and taken, compiled."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.planning.bodies import place_still_bodies
from scene_graph_ros.planning.edge_kernels import prove_edge
from scene_graph_ros.planning.edge_stretches import FREE, UNFINISHED
from scene_graph_ros.planning.growth_kernels import propose_growth, take_growth
from scene_graph_ros.planning.search_state import (
    EDGES,
    LOOKS,
    PAUSED,
    PHASE,
    PROVE,
    SHORTEN,
    STOPPED,
)
from scene_graph_ros.planning.shortcut_kernels import propose_shortcut, take_shortcut

__all__ = ["search"]


@lean_kernel
def search(
    held, tree, bodies, pairs, reaches, X_WB, rules, stop, space, longest, trees, path, samples,
    state, edge, numbers, motions, stretches, places,
):  # fmt: skip
    """Go on with a search until something is missing, or all is done; return which.

    ``samples`` are random configurations ``(n, nq)``. An edge that was being proven when ``stop``
    was set, or that was not finished after its looks, is dropped. What came before does not
    depend on where calls began and ended.
    """
    place_still_bodies(bodies, places)
    while True:
        is_growing = state[PHASE] != SHORTEN
        if is_growing:
            answer = propose_growth(tree, space, trees, samples, longest, state, edge)
        else:
            answer = propose_shortcut(tree, space, path, state, edge)
        if answer != PROVE:
            return answer
        status, _ = prove_edge(
            held, tree, bodies, pairs, reaches, edge[:2], X_WB, rules, stop, motions, stretches,
            places, numbers,
        )  # fmt: skip
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
