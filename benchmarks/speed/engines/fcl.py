"""FCL by way of python-fcl, with its dynamic AABB trees."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import fcl_shape
from benchmarks.speed.scenes import Scene

__all__ = ["Fcl"]


class Fcl:
    """``DynamicAABBTreeCollisionManager``. It has no filters, and no distances of all pairs."""

    name = "FCL"

    def __init__(self, scene: Scene) -> None:
        frames = [body.frame for body in scene.moving]
        if scene.excluded or len(set(frames)) < len(frames):
            raise NotImplementedError("python-fcl has no filters")
        self._fcl: Any = importlib.import_module("fcl")
        self._scene = scene
        # Where they are at first: a tree of things that are all in one place takes long to mend.
        starts = zip(scene.moving, scene.moving_poses(scene.X_WF[0]), strict=True)
        self._moving = [self._object(body.shape, X_WG) for body, X_WG in starts]
        self._fixed = [self._object(body.shape, body.X_FG) for body in scene.anchored]
        self._trees = [self._tree(self._moving), self._tree(self._fixed)]
        self.choose(scene.X_WF, 0.0)

    def _object(self, shape: Any, X_WG: np.ndarray) -> Any:
        return self._fcl.CollisionObject(fcl_shape(shape), self._transform(X_WG))

    def _transform(self, X: np.ndarray) -> Any:
        return self._fcl.Transform(X[:3, :3], X[:3, 3])

    def _tree(self, objects: list[Any]) -> Any:
        tree = self._fcl.DynamicAABBTreeCollisionManager()
        tree.registerObjects(objects)
        tree.setup()
        return tree

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine."""
        del max_distance
        self._sets = [
            [self._transform(X) for X in self._scene.moving_poses(X_WF)] for X_WF in X_WFs
        ]

    def move(self, k: int) -> None:
        """See Engine; there is no bulk form."""
        for o, X in zip(self._moving, self._sets[k % len(self._sets)], strict=True):
            o.setTransform(X)
        self._trees[0].update()

    def _collide(self, limit: int, with_points: bool) -> Any:
        request = self._fcl.CollisionRequest(num_max_contacts=limit, enable_contact=with_points)
        data = self._fcl.CollisionData(request=request)
        self._trees[0].collide(data, self._fcl.defaultCollisionCallback)
        if self._fixed:
            self._trees[0].collide(self._trees[1], data, self._fcl.defaultCollisionCallback)
        return data.result

    def penetrations(self) -> Any:
        """Return the result with all contacts."""
        return self._collide(1_000_000, with_points=True)

    def collides(self) -> Any:
        """Return the result with one contact at most."""
        return self._collide(1, with_points=False)

    def count(self, row: str, result: Any) -> int:
        """See Engine; some pairs have several contacts."""
        if row == "collides":
            return int(result.is_collision)
        return len({frozenset((id(c.o1), id(c.o2))) for c in result.contacts})
