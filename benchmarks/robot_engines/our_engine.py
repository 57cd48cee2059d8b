"""Ours: batches, and proofs in place of samples."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.planning import SceneGraphCollisionChecker

__all__ = ["OurBatches", "OurEngine"]


class OurEngine:
    """`SceneGraphCollisionChecker`."""

    name = "scene_graph_ros"

    def __init__(self, checker: SceneGraphCollisionChecker) -> None:
        self._checker = checker

    def collide(self, q: np.ndarray) -> np.ndarray:
        """See RobotEngine."""
        return ~self._checker.check_configs_collision_free(q)

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine; proven, whatever the step."""
        del step
        return ~self._checker.check_edges_collision_free(edges)

    def clearances(self, q: np.ndarray, influence: float) -> np.ndarray:
        """See ClearanceEngine."""
        return np.array([self._checker.calc_robot_clearance(each, influence).size for each in q])


class OurBatches:
    """All clearances in one call."""

    name = "ours at once"

    def __init__(self, checker: SceneGraphCollisionChecker) -> None:
        self._checker = checker

    def clearances(self, q: np.ndarray, influence: float) -> np.ndarray:
        """See ClearanceEngine."""
        return np.array([each.size for each in self._checker.calc_robot_clearances(q, influence)])
