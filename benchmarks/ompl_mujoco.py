"""OMPL's RRT-Connect with MuJoCo's checks: what people put together who have no proofs.

Motions are sampled by OMPL's own validator at steps of at most 0.05 rad. Each sample is a call
of a function in Python that writes MuJoCo's positions and calls its kinematics and collisions.
``PathSimplifier.simplifyMax`` shortens the path by the same checks.
"""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple

import numpy as np

from benchmarks.robot_engines.mujoco_engine import MuJoCoEngine
from benchmarks.robot_engines.robot_world import RobotWorld
from scene_graph_ros.planning import SceneGraphCollisionChecker
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["SampledPath", "SampledPlanner"]

_STEP = 0.05
"""rad, between samples of a motion."""


def _rows_of(tree: KinematicTree, moving: np.ndarray) -> np.ndarray:
    """Return the joints that positions are of. Raises ValueError where others follow them."""
    names = [joint.mimics or joint.name for joint in tree.joints]
    columns = np.array([tree.position_index(name) for name in names])
    rows = np.flatnonzero(np.isin(columns, moving))
    if len(rows) != len(moving):
        raise ValueError("joints of the group are followed by others")
    return rows[np.argsort(columns[rows])]


class SampledPath(NamedTuple):
    """What OMPL found."""

    configurations: np.ndarray
    """``(n, nq)``; none where nothing was found in time."""
    checks: int


class SampledPlanner:
    """Plans for the joints of a group, in one scene."""

    def __init__(self, checker: SceneGraphCollisionChecker, group: str) -> None:
        """Raise ImportError where OMPL or MuJoCo are not installed."""
        self._base: Any = importlib.import_module("ompl.base")
        self._geometric: Any = importlib.import_module("ompl.geometric")
        util: Any = importlib.import_module("ompl.util")
        util.setLogLevel(util.LOG_NONE)
        self._tree = checker.model.tree
        self._world = RobotWorld.of(checker)
        self._engine = MuJoCoEngine(self._world)
        self._moving = np.flatnonzero(
            np.isin(np.arange(self._tree.num_positions), self._tree.group_positions(group))
        )
        self._rows = _rows_of(self._tree, self._moving)
        """``(k,)``: of MuJoCo's positions, one for each that moves."""

    def plan(
        self, start: np.ndarray, goal: np.ndarray, timeout: float, *, shortened: bool
    ) -> SampledPath:
        """Return a path from start to goal, shortened or as it was found."""
        base, geometric = self._base, self._geometric
        moving, checks = self._moving, 0
        qpos, touches = self._engine.qpos, self._engine.new_check()
        qpos[:] = self._world.all_positions(np.array(start, dtype=float)[np.newaxis])[0]
        reads = tuple((int(row), k) for k, row in enumerate(self._rows))

        def is_valid(state: Any) -> bool:
            nonlocal checks
            checks += 1
            for row, k in reads:
                qpos[row] = state[k]
            return not touches()

        space = base.RealVectorStateSpace(len(moving))
        bounds = base.RealVectorBounds(len(moving))
        for k, row in enumerate(moving):
            bounds.setLow(k, float(self._tree.lower[row]))
            bounds.setHigh(k, float(self._tree.upper[row]))
        space.setBounds(bounds)
        information = base.SpaceInformation(space)
        information.setStateValidityChecker(is_valid)
        information.setStateValidityCheckingResolution(_STEP / space.getMaximumExtent())
        information.setup()
        ends = []
        for q in (start, goal):
            state = information.allocState()
            for k, row in enumerate(moving):
                state[k] = float(q[row])
            ends.append(state)
        problem = base.ProblemDefinition(information)
        problem.setStartAndGoalStates(*ends)
        planner = geometric.RRTConnect(information)
        planner.setProblemDefinition(problem)
        planner.setup()
        planner.solve(timeout)
        rows = np.empty((0, len(start)))
        if problem.hasExactSolution():
            path = problem.getSolutionPath()
            if shortened:
                geometric.PathSimplifier(information).simplifyMax(path)
            states = [[state[k] for k in range(len(moving))] for state in path.getStates()]
            rows = np.repeat(np.array(start, dtype=float)[np.newaxis], len(states), axis=0)
            rows[:, moving] = states
        # So that nothing of this is kept by OMPL's objects, which hold each other.
        information.setStateValidityChecker(base.AllValidStateValidityChecker(information))
        return SampledPath(rows, checks)
