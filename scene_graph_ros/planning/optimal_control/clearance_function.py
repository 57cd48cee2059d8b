"""How far a robot is from all else, as a smooth lower bound with exact derivatives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.optimal_control.numpy_function import NumpyFunction

__all__ = ["clearance_function"]

_SHARPNESS = 30.0
"""Times the least clearance that matters: pairs that are farther by a tenth of it count 5 %."""


def clearance_function(
    checker: CollisionChecker, influence_distance: float, scale: float
) -> NumpyFunction:
    """Return the function of q ``(nq,)`` to a number that no pair's distance is below, m.

    It is the soft minimum ``-log(sum exp(-a d)) / a`` of the padded distances up to
    ``influence_distance`` and of that distance itself, with ``a = 30 / scale``: below the least
    distance by some log(k) / a where k pairs are as near. Its gradient is exact, by the Jacobians
    of the checker's clearance; it has no second derivatives here.
    """
    sharpness = _SHARPNESS / scale
    asked: dict[bytes, tuple[float, NDArray[np.float64]]] = {}

    def both(q: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        if not np.isfinite(q).all():  # A step of the solver's that it will shorten.
            return np.nan, np.full(len(q), np.nan)
        key = q.tobytes()
        if key not in asked:
            asked.clear()
            table = checker.calc_robot_clearance(q, influence_distance)
            near = np.asarray(table.distances)
            least = min(float(near.min(initial=np.inf)), influence_distance)
            # Relative to the least, so that nothing overflows; what is at the edge counts nothing.
            base = np.exp(-sharpness * (influence_distance - least))
            parts = np.maximum(np.exp(-sharpness * (near - least)) - base, 0.0)
            total = base + parts.sum()
            slopes = np.where(parts > 0.0, np.exp(-sharpness * (near - least)), 0.0) / total
            gradient = slopes @ np.asarray(table.jacobians).reshape(len(near), len(q))
            asked[key] = least - float(np.log(total)) / sharpness, gradient
        return asked[key]

    size = checker.model.tree.num_positions
    return NumpyFunction(
        "clearance",
        (size,),
        1,
        lambda q: np.array([both(q)[0]]),
        lambda q: [both(q)[1][np.newaxis]],
    )
