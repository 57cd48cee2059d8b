"""Coal with its dynamic AABB trees: one for what moves, one for what never does."""

from __future__ import annotations

from collections.abc import Callable
import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import coal_shape
from benchmarks.speed.scenes import Scene

__all__ = ["Coal"]


class Coal:
    """``DynamicAABBTreeCollisionManager``. Distances are contacts within a security margin."""

    name = "Coal"

    def __init__(self, scene: Scene) -> None:
        frames = [body.frame for body in scene.moving]
        if scene.excluded or len(set(frames)) < len(frames):
            raise NotImplementedError("Coal's trees have no filters in Python")
        self._coal: Any = importlib.import_module("coal")
        self._scene = scene
        # Where they are at first: a tree of things that are all in one place takes long to mend.
        starts = zip(scene.moving, scene.moving_poses(scene.X_WF[0]), strict=True)
        self._moving = [self._object(body.shape, X_WG) for body, X_WG in starts]
        self._fixed = [self._object(body.shape, body.X_FG) for body in scene.anchored]
        self._trees = [self._tree(self._moving), self._tree(self._fixed)]
        self._margin = 0.0
        self._room = 20 * scene.size  # is allocated at each call
        self.choose(scene.X_WF, 0.0)

    def _object(self, shape: Any, X_WG: np.ndarray) -> Any:
        return self._coal.CollisionObject(coal_shape(shape), self._transform(X_WG))

    def _transform(self, X: np.ndarray) -> Any:
        return self._coal.Transform3s(X[:3, :3], X[:3, 3])

    def _tree(self, objects: list[Any]) -> Any:
        tree = self._coal.DynamicAABBTreeCollisionManager()
        for o in objects:
            tree.registerObject(o)
        tree.setup()
        return tree

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine. Boxes are grown by half the distance, as the trees look at boxes only."""
        self._margin = max_distance
        self._sets = [
            [self._transform(X) for X in self._scene.moving_poses(X_WF)] for X_WF in X_WFs
        ]
        for o in self._fixed:
            self._bound(o)
        self._trees[1].update()

    def _bound(self, o: Any) -> None:
        o.computeAABB()
        if self._margin > 0.0:
            o.getAABB().expand(0.5 * self._margin)

    def move(self, k: int) -> None:
        """See Engine; there is no bulk form."""
        if self._margin > 0.0:
            half = 0.5 * self._margin
            for o, X in zip(self._moving, self._sets[k % len(self._sets)], strict=True):
                o.setTransform(X)
                o.computeAABB()
                o.getAABB().expand(half)
        else:
            for o, X in zip(self._moving, self._sets[k % len(self._sets)], strict=True):
                o.setTransform(X)
                o.computeAABB()
        self._trees[0].update()

    def _count(self, make_callback: Callable[[], Any], count: Callable[[Any], int]) -> int:
        """Return what a callback counts among what moves, and between that and what doesn't."""
        callback = make_callback()  # each search clears its results
        self._trees[0].collide(callback)
        found = count(callback)
        if self._fixed:
            callback = make_callback()
            self._trees[0].collide(self._trees[1], callback)
            found += count(callback)
        return found

    def candidates(self) -> Any:
        """Return the number of pairs whose boxes meet."""
        return self._count(
            lambda: self._coal.CollisionCallBackCollect(self._room),
            lambda callback: callback.numCollisionPairs(),
        )

    def _contacts(self, margin: float, limit: int, with_points: bool) -> Any:
        def make_callback() -> Any:
            callback = self._coal.CollisionCallBackDefault()
            request = callback.data.request
            request.num_max_contacts, request.enable_contact = limit, with_points
            request.security_margin = margin
            return callback

        return self._count(make_callback, lambda callback: callback.data.result.numContacts())

    def penetrations(self) -> Any:
        """Return the number of contacts, one for each penetrating pair."""
        return self._contacts(0.0, 1_000_000, with_points=True)

    def distances(self, max_distance: float) -> Any:
        """Return the number of pairs nearer than a margin (m); depths are signed distances."""
        return self._contacts(max_distance, 1_000_000, with_points=True)

    def collides(self) -> Any:
        """Return the number of contacts, at most one."""
        return self._contacts(0.0, 1, with_points=False)

    def count(self, row: str, result: Any) -> int:
        """See Engine."""
        return int(result)
