"""Pinocchio with Coal: a tree of boxes around geometries, for each configuration."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import coal_shape
from benchmarks.robot_engines.robot_world import RobotWorld, samples_of

__all__ = ["PinocchioEngine"]


class PinocchioEngine:
    """``computeCollisions`` with a broad phase, until the first contact."""

    name = "pinocchio, Coal"

    def __init__(self, world: RobotWorld) -> None:
        self._world, self._pin = world, importlib.import_module("pinocchio")
        pin: Any = self._pin
        self._model = model = pin.Model()
        for name, turns, parent, X in world.placed_joints():
            kind = pin.JointModelRZ() if turns else pin.JointModelPZ()
            model.addJoint(parent, kind, pin.SE3(X), name)
        geometries = pin.GeometryModel()
        for k, thing in enumerate(world.things):
            shape = coal_shape(thing.shape)
            place = pin.SE3(np.ascontiguousarray(thing.X))
            geometries.addGeometryObject(
                pin.GeometryObject(f"thing_{k}", thing.joint, place, shape)
            )
        for a, b in world.pairs:
            geometries.addCollisionPair(pin.CollisionPair(int(a), int(b)))
        self._geometries = geometries
        self._data, self._geometry_data = model.createData(), geometries.createData()
        self._manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            model, geometries, self._geometry_data
        )

    def collide(self, q: np.ndarray) -> np.ndarray:
        """See RobotEngine."""
        return np.array([self.collides(each) for each in self._world.all_positions(q)])

    def collides(self, positions: np.ndarray) -> bool:
        """Tell whether the positions ``(j,)`` of all joints collide."""
        return bool(
            self._pin.computeCollisions(self._model, self._data, self._manager, positions, True)
        )

    @property
    def places(self) -> Any:
        """Where geometries are, as ``SE3``, for the positions that were asked about last."""
        return self._geometry_data.oMg

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine."""
        result = np.zeros(len(edges), dtype=np.bool_)
        for k, edge in enumerate(edges):
            positions = self._world.all_positions(samples_of(edge, step))
            result[k] = any(map(self.collides, positions))
        return result
