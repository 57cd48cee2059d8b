"""Distances of pairs of rows by the address of their measuring function, one after the other."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.spatial.vectors import load_rotation, load_translation
from scene_graph_ros.planning.pairs.pair_measure import pair_distance

__all__ = ["measure_pairs"]


@lean_kernel
def measure_pairs(held, measure, X_WG, pairs, max_distance, distances):
    """Write the distance of each pair ``(k, 2)``; beyond the limit it is a bound above that."""
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        X_WA = load_rotation(X_WG, i), load_translation(X_WG, i)
        X_WB = load_rotation(X_WG, j), load_translation(X_WG, j)
        arguments = held, i, j, X_WA, X_WB, max_distance, 0.0
        distances[k] = pair_distance(measure, arguments)[0]
