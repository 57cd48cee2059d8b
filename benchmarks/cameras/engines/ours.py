"""Our own renderer, all kinds in one pass."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.cameras.engines.engine import distinct_colors, KINDS
from benchmarks.cameras.scenes import CameraScene, CLIPPING
from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    PerceptionProperties,
    Rgba,
    SceneGraph,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    ImageKind,
    RenderCameraCore,
)
from scene_graph_ros.geometry.perception.exact.view import look

__all__ = ["Ours"]


class Ours:
    """``query.render_images``."""

    name = "scene_graph_ros"
    kinds = KINDS

    def __init__(self, scene: CameraScene, lens: CameraIntrinsics) -> None:
        graph = SceneGraph()
        graph.add_renderer("exact", ExactRenderEngine())
        self._source = graph.register_source("benchmark")
        for k, (shape, color) in enumerate(
            zip(scene.shapes, distinct_colors(len(scene.shapes)), strict=True)
        ):
            frame = graph.register_frame(self._source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"body_{k}")
            seen = PerceptionProperties()
            seen.add_property("label", "id", k)
            seen.add_property("phong", "diffuse", Rgba(*color.tolist()))
            instance.set_perception_properties(seen)
            graph.register_geometry(self._source, frame, instance)
        self._core = RenderCameraCore("exact", lens, CLIPPING)
        self._camera = DepthRenderCamera(self._core, DepthRange(CLIPPING.near, CLIPPING.far))
        self._context = graph.create_default_context()
        self._query = graph.query_object(self._context)
        self._world, self._X_WGs = graph.world_frame_id(), scene.X_WGs

    def ask(self, k: int, kinds: tuple[str, ...]) -> Any:
        """See Engine."""
        self._context.set_frame_poses(self._source, self._X_WGs[k])
        wanted = [ImageKind(kind) for kind in kinds]
        return self._query.render_images(self._camera, self._world, np.eye(4), kinds=wanted)

    def depth(self, answer: Any) -> np.ndarray:
        """See Engine."""
        return np.asarray(answer.depth, np.float64)

    def unrounded(self, k: int) -> np.ndarray:
        """Return depths (height, width) before they are rounded to float32."""
        self._context.set_frame_poses(self._source, self._X_WGs[k])
        view = look(self._query.snapshot, self._core, np.eye(4), (1.0, 1.0, 1.0, 1.0))
        lens = self._core.intrinsics
        return np.array(view.screen.depth[: lens.height, : lens.width])

    def close(self) -> None:
        """See Engine."""
