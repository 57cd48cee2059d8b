"""Edges that can't be on a simple path, as flows show: a stronger preprocessing, by programs."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["on_disjoint_ways"]


def on_disjoint_ways(network: Network, by: SolverChoice) -> np.ndarray:
    """Return edges ``(k,)`` that a way leads to and another on from, apart from each other.

    For each edge a program of two flows, to its tail and on from its head, which together visit
    no vertex more than once (Marcucci, Petersen, von Wrangel and Tedrake, "Motion planning around
    obstacles with convex optimization", 2023, section V). An edge is left out where weights prove
    that there are none, also against the solver; it stays where the solver fails.
    """
    return np.array(
        [e for e in range(len(network.tails)) if not _is_shut_off(network, e, by)],
        dtype=np.int64,
    )


def _is_shut_off(network: Network, edge: int, by: SolverChoice) -> bool:
    u, v = int(network.tails[edge]), int(network.heads[edge])
    ends = ((network.source, u), (v, network.target))
    program, m = ConeProgram(), len(network.tails)
    flows = [program.variables(m) for _ in ends]
    program.add_rows(Cone.NONNEGATIVE, [(np.concatenate(flows), np.eye(2 * m))], np.zeros(2 * m))
    for each, (start, goal) in zip(flows, ends, strict=True):
        for w in range(network.size):
            into, out = network.entering[w], network.leaving[w]
            blocks = [(each[into], np.ones((1, len(into)))), (each[out], -np.ones((1, len(out))))]
            excess = float(w == start) - float(w == goal)
            program.add_rows(Cone.ZERO, blocks, np.array([excess]))
    for w in range(network.size):
        into = network.entering[w]
        blocks = [(each[into], -np.ones((1, len(into)))) for each in flows]
        begun = float(w == network.source) + float(w == v)
        program.add_rows(Cone.NONNEGATIVE, blocks, np.array([1.0 - begun]))
    try:
        found = program.solve("GraphOfConvexSets: preprocessing", by=by)
    except SolverError:
        return False
    if found.is_feasible:
        return False
    A, b = program.form()[:2]
    z = np.concatenate(found.duals)
    z[program.num_equations :] = np.maximum(z[program.num_equations :], 0.0)
    # Flows are from 0 to 1: whatever they are, what the weights say of all rows is below 0.
    weighed = A.T @ z
    most = float(b @ z) + float(np.maximum(-weighed, 0.0).sum())
    size = float(np.abs(b) @ np.abs(z)) + float((abs(A).T @ np.abs(z)).sum())
    return most < -8.0 * (len(z) + 8) * EPSILON * size
