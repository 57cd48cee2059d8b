"""A checker's robots and surroundings as numbers that every engine can be made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from scene_graph_ros.geometry import HalfSpace, Shape
from scene_graph_ros.planning import SceneGraphCollisionChecker
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import REVOLUTE

__all__ = ["ClearanceEngine", "RobotEngine", "RobotWorld", "Thing"]


class RobotEngine(Protocol):
    """Answers about many configurations with one thread."""

    name: str

    def collide(self, q: np.ndarray) -> np.ndarray:
        """Tell of configurations ``(n, nq)`` which collide."""

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """Tell of edges ``(n, 2, nq)`` which collide, by samples at steps; stop at the first."""


@runtime_checkable
class ClearanceEngine(Protocol):
    """Tells distances up to a limit, and their derivatives by the configuration."""

    name: str

    def clearances(self, q: np.ndarray, influence: float) -> np.ndarray:
        """Work them out for configurations ``(n, nq)``; return counts ``(n,)``."""


@dataclass(frozen=True)
class Thing:
    """A geometry."""

    shape: Shape
    joint: int
    """Which joint moves it, from 1 on; 0 where none does."""
    X: np.ndarray
    """``(4, 4)``: in the joint's frame, or the world."""


@dataclass(frozen=True)
class RobotWorld:
    """Joints, geometries and the pairs that may not touch."""

    tree: KinematicTree
    """Joints turn about the z axes of their frames, or slide along them."""
    things: tuple[Thing, ...]
    pairs: np.ndarray
    """``(p, 2)``: of things."""

    @classmethod
    def of(cls, checker: SceneGraphCollisionChecker) -> RobotWorld:
        """Return what a checker checks. Its joints must turn or slide."""
        plan, inspector = checker.plan, checker.snapshot.inspector
        robots, things = len(plan.bodies.joints), []
        for k, geometry in enumerate(plan.geometry_ids):
            X = np.eye(4)
            X[:3] = plan.bodies.X_JG[k] if k < robots else plan.bodies.X_WG[k - robots]
            joint = int(plan.bodies.joints[k]) if k < robots else 0
            if k < robots and joint == 0:
                X = plan.tree.X_WB @ X
            things.append(Thing(inspector.get_shape(geometry), joint, X))
        return cls(plan.tree, tuple(things), np.array(plan.pairs.bodies))

    @property
    def excluded(self) -> list[tuple[int, int]]:
        """Pairs of things that may touch, of which a joint moves one at least."""
        checked = {(int(min(pair)), int(max(pair))) for pair in self.pairs}
        moving = [k for k, thing in enumerate(self.things) if thing.joint]
        pairs = {(min(a, b), max(a, b)) for a in moving for b in range(len(self.things)) if a != b}
        return sorted(pairs - checked)

    def without_half_spaces(self) -> RobotWorld:
        """Return the same without half spaces."""
        kept = [k for k, thing in enumerate(self.things) if not isinstance(thing.shape, HalfSpace)]
        row_of = np.full(len(self.things), -1)
        row_of[kept] = np.arange(len(kept))
        pairs = row_of[self.pairs]
        things = tuple(self.things[k] for k in kept)
        return RobotWorld(self.tree, things, pairs[(pairs >= 0).all(axis=1)])

    def placed_joints(self) -> list[tuple[str, bool, int, np.ndarray]]:
        """Return of each joint its name, whether it turns, its parent's row, and where it is.

        Rows are from 1 on; of those without a parent, 0, the place ``(4, 4)`` is in the world.
        """
        rows = []
        for joint in self.tree.joints:
            X = joint.X_PJ if joint.parent else self.tree.X_WB @ joint.X_PJ
            rows.append((joint.name, joint.kind == REVOLUTE, joint.parent, X))
        return rows

    def all_positions(self, q: np.ndarray) -> np.ndarray:
        """Return the positions ``(n, j)`` of all joints, those that follow others included."""
        columns = []
        for joint in self.tree.joints:
            followed = joint.mimics or joint.name
            column = q[:, self.tree.position_index(followed)]
            columns.append(joint.multiplier * column + joint.offset if joint.mimics else column)
        return np.ascontiguousarray(np.stack(columns, axis=1))


def samples_of(edge: np.ndarray, step: float) -> np.ndarray:
    """Return samples ``(k, nq)`` of an edge ``(2, nq)``, both ends first, then in between."""
    steps = max(1, int(np.ceil(np.linalg.norm(edge[1] - edge[0]) / step)))
    t = np.linspace(0.0, 1.0, steps + 1)[:, np.newaxis]
    return (1.0 - t) * edge[0] + t * edge[1]
