"""Which way leads a configuration away from what it collides with, or nearly so."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["compute_collision_avoidance_displacement"]


def compute_collision_avoidance_displacement(
    checker: CollisionChecker, q: ArrayLike, max_penetration: float, max_clearance: float
) -> NDArray[np.float64]:
    """Return a displacement ``(nq,)`` that increases padded distances at q ``(nq,)``.

    It is the sum over all pairs nearer than ``max_clearance`` of the distance's gradient by q. Its
    weight grows linearly from 0 at ``max_clearance`` to 1 at ``max_penetration`` and below, both
    in m, the latter at most 0. To be followed in small steps; zero where nothing is near, and
    where gradients cancel each other. A quaternion has to be normalized after a step.

    Raises CollisionCheckerError for other numbers, and KinematicTreeError for a bad q.
    """
    given: Any = checker
    if not isinstance(given, CollisionChecker):
        raise CollisionCheckerError(f"checker must be a CollisionChecker, not {quoted(given)}")
    least, most = as_float(max_penetration), as_float(max_clearance)
    if least is None or not -math.inf < least <= 0.0:
        raise CollisionCheckerError(
            f"max_penetration must be a finite number, at most 0, not {quoted(max_penetration)}"
        )
    if most is None or not max(least, 0.0) <= most < math.inf or most == least:
        raise CollisionCheckerError(
            "max_clearance must be a finite number, at least 0 and above max_penetration"
            f" {least:g}, not {quoted(max_clearance)}"
        )
    near = checker.calc_robot_clearance(q, most)
    weights = np.clip((most - near.distances) / (most - least), 0.0, 1.0)
    return np.asarray(np.sum(weights[:, np.newaxis] * near.jacobians, axis=0), dtype=np.float64)
