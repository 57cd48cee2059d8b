"""A ray caster in float32: Embree by way of embreex, for meshes only.

Its tree of triangles is built before time is taken, for bodies at rest: to build it anew for poses
that change takes longer than the rays.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.cameras.scenes import CameraScene, CLIPPING
from scene_graph_ros.geometry.perception import CameraIntrinsics

__all__ = ["Embree"]


class Embree:
    """``EmbreeScene.run`` for all rays of an image at once."""

    name = "Embree, float32"
    kinds = ("depth",)

    def __init__(self, scene: CameraScene, lens: CameraIntrinsics) -> None:
        module = importlib.import_module("embreex.rtcore_scene")
        triangles = importlib.import_module("embreex.mesh_construction")
        if not scene.is_of_meshes:
            raise RuntimeError("it has triangles only")
        corners = np.concatenate(
            [
                (np.asarray(shape.vertices) @ X[:3, :3].T + X[:3, 3])[np.asarray(shape.faces)]
                for shape, X in zip(scene.shapes, scene.X_WGs[0], strict=True)
            ]
        ).astype(np.float32)
        self._scene = module.EmbreeScene()
        self._mesh = triangles.TriangleMesh(self._scene, corners)
        u, v = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
        rays = np.stack([(u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, np.ones(u.shape)], -1)
        self._directions = np.ascontiguousarray(rays.reshape(-1, 3), np.float32)
        self._origins = np.zeros_like(self._directions)
        self._shape = u.shape

    def ask(self, k: int, kinds: tuple[str, ...]) -> Any:
        """See Engine; of the first set of poses, whatever ``k`` is."""
        del k, kinds
        return self._scene.run(self._origins, self._directions, output=True)

    def depth(self, answer: Any) -> np.ndarray:
        """See Engine."""
        depth = np.asarray(answer["tfar"], np.float64).reshape(self._shape)
        is_hit = np.asarray(answer["primID"]).reshape(self._shape) >= 0
        return np.where(is_hit & (depth <= CLIPPING.far), depth, np.inf)

    def close(self) -> None:
        """See Engine."""
