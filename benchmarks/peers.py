"""The same scene in other libraries, as their users would write it in Python."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.scenes import MixedScene
from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Sphere
from scene_graph_ros.geometry.meshes.sources import hull_of

__all__ = ["PEERS", "Coal", "Fcl"]


def _triangles_of(shape: Convex) -> tuple[np.ndarray, np.ndarray]:
    hull = hull_of(shape)
    fans = [np.column_stack([np.full(len(f) - 2, f[0]), f[1:-1], f[2:]]) for f in hull.faces]
    return hull.vertices, np.concatenate(fans)


class Fcl:
    """python-fcl with its DynamicAABBTreeCollisionManager."""

    name = "python-fcl"

    def __init__(self, scene: MixedScene) -> None:
        self._fcl: Any = importlib.import_module("fcl")
        self._poses = scene.poses
        self._objects = [self._fcl.CollisionObject(self._shape(s)) for s in scene.shapes]
        self.move_objects(0)
        self._manager = self._fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._objects)
        self._manager.setup()

    def _shape(self, shape: object) -> Any:
        match shape:
            case Sphere():
                return self._fcl.Sphere(shape.radius)
            case Box():
                return self._fcl.Box(shape.width, shape.depth, shape.height)
            case Capsule():
                return self._fcl.Capsule(shape.radius, shape.length)
            case Cylinder():
                return self._fcl.Cylinder(shape.radius, shape.length)
            case Ellipsoid():
                return self._fcl.Ellipsoid(shape.a, shape.b, shape.c)
        assert isinstance(shape, Convex)
        vertices, triangles = _triangles_of(shape)
        faces = np.concatenate([np.full((len(triangles), 1), 3), triangles], axis=1).flatten()
        return self._fcl.Convex(vertices, len(triangles), faces)

    def move_objects(self, k: int) -> None:
        """Set every object's transform, without the manager's update."""
        poses = self._poses[k % len(self._poses)]
        for o, X in zip(self._objects, poses, strict=True):
            o.setTransform(self._fcl.Transform(X[:3, :3], X[:3, 3]))

    def move(self, k: int) -> None:
        """Give every object a new pose."""
        self.move_objects(k)
        self._manager.update()

    def penetrations(self) -> int:
        """Return the number of penetrating pairs, one contact each."""
        request = self._fcl.CollisionRequest(num_max_contacts=1_000_000, enable_contact=True)
        data = self._fcl.CollisionData(request=request)
        self._manager.collide(data, self._fcl.defaultCollisionCallback)
        return len({frozenset((id(c.o1), id(c.o2))) for c in data.result.contacts})


class Coal:
    """Coal with its DynamicAABBTreeCollisionManager."""

    name = "coal"

    def __init__(self, scene: MixedScene) -> None:
        self._coal: Any = importlib.import_module("coal")
        self._poses = scene.poses
        self._objects = [self._coal.CollisionObject(self._shape(s)) for s in scene.shapes]
        self._manager = self._coal.DynamicAABBTreeCollisionManager()
        for o in self._objects:
            self._manager.registerObject(o)
        self._manager.setup()

    def _shape(self, shape: object) -> Any:
        match shape:
            case Sphere():
                return self._coal.Sphere(shape.radius)
            case Box():
                return self._coal.Box(shape.width, shape.depth, shape.height)
            case Capsule():
                return self._coal.Capsule(shape.radius, shape.length)
            case Cylinder():
                return self._coal.Cylinder(shape.radius, shape.length)
            case Ellipsoid():
                return self._coal.Ellipsoid(shape.a, shape.b, shape.c)
        assert isinstance(shape, Convex)
        vertices, triangles = _triangles_of(shape)
        points = self._coal.StdVec_Vec3s()
        points.extend(list(vertices))
        faces = self._coal.StdVec_Triangle()
        for t in triangles:
            faces.append(self._coal.Triangle(*(int(v) for v in t)))
        return self._coal.Convex(points, faces)

    def move(self, k: int) -> None:
        """Give every object a new pose."""
        poses = self._poses[k % len(self._poses)]
        for o, X in zip(self._objects, poses, strict=True):
            o.setTransform(self._coal.Transform3s(X[:3, :3], X[:3, 3]))
            o.computeAABB()
        self._manager.update()

    def candidates(self) -> int:
        """Return the number of pairs whose boxes overlap."""
        collect = self._coal.CollisionCallBackCollect(1_000_000)
        self._manager.collide(collect)
        return collect.numCollisionPairs()

    def penetrations(self) -> int:
        """Return the number of penetrating pairs, one contact each."""
        callback = self._coal.CollisionCallBackDefault()
        callback.data.request.num_max_contacts = 1_000_000
        self._manager.collide(callback)
        return callback.data.result.numContacts()


PEERS = (Fcl, Coal)
"""Those whose import fails are left out of the table, and that is said."""
