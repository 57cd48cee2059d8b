"""Drake's renderers by way of pydrake: VTK, which finds software GL by EGL, and GL, which needs X.

The rays of both go half a pixel beside the ones that their intrinsics name (drake#10190); so that
they are compared where they look, they get a principal point half a pixel further.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.cameras.engines.engine import distinct_colors, KINDS
from benchmarks.cameras.scenes import CameraScene, CLIPPING
from benchmarks.peer_shapes import drake_shape
from scene_graph_ros.geometry.perception import CameraIntrinsics

__all__ = ["DrakeGl", "DrakeVtk"]

_RENDERER = "renderer"
_HALF_A_PIXEL = 0.5


class _Drake:
    """``pydrake.geometry.QueryObject``; poses go in as one FramePoseVector."""

    name = ""
    kinds = KINDS

    def _engine(self, drake: Any) -> Any:
        raise NotImplementedError

    def __init__(self, scene: CameraScene, lens: CameraIntrinsics) -> None:
        drake = importlib.import_module("pydrake.geometry")
        sensors = importlib.import_module("pydrake.systems.sensors")
        self._pose: Any = importlib.import_module("pydrake.math").RigidTransform
        graph = drake.SceneGraph()
        graph.AddRenderer(_RENDERER, self._engine(drake))
        source = graph.RegisterSource("benchmark")
        frames = [
            graph.RegisterFrame(source, drake.GeometryFrame(f"frame_{k}"))
            for k in range(len(scene.shapes))
        ]
        shapes = {id(shape): drake_shape(shape) for shape in scene.shapes}
        colors = distinct_colors(len(frames))
        for k, (frame, shape) in enumerate(zip(frames, scene.shapes, strict=True)):
            instance = drake.GeometryInstance(self._pose(), shapes[id(shape)], f"body_{k}")
            seen = drake.PerceptionProperties()
            seen.AddProperty("label", "id", drake.RenderLabel(k))
            seen.AddProperty("phong", "diffuse", drake.Rgba(*colors[k].tolist(), 1.0))
            instance.set_perception_properties(seen)
            graph.RegisterGeometry(source, frame, instance)
        self._context = graph.CreateDefaultContext()
        self._port = graph.get_source_pose_port(source)
        self._sets = [self._vector(drake, frames, X_WG) for X_WG in scene.X_WGs]
        self._port.FixValue(self._context, self._sets[0])
        self._query = graph.get_query_output_port().Eval(self._context)
        center = (lens.cx + _HALF_A_PIXEL, lens.cy + _HALF_A_PIXEL)
        info = sensors.CameraInfo(lens.width, lens.height, lens.fx, lens.fy, *center)
        clipping = drake.ClippingRange(CLIPPING.near, CLIPPING.far)
        core = drake.RenderCameraCore(_RENDERER, info, clipping, self._pose())
        depths = drake.DepthRange(CLIPPING.near, CLIPPING.far)
        color, depth = drake.ColorRenderCamera(core, False), drake.DepthRenderCamera(core, depths)
        ask, where = self._query, (graph.world_frame_id(), self._pose())
        self._renders = {
            "depth": lambda: ask.RenderDepthImage(depth, *where),
            "label": lambda: ask.RenderLabelImage(color, *where),
            "color": lambda: ask.RenderColorImage(color, *where),
        }
        self._graph = graph

    def _vector(self, drake: Any, frames: list[Any], X_WG: np.ndarray) -> Any:
        result = drake.FramePoseVector()
        for frame, X in zip(frames, X_WG, strict=True):
            result.set_value(frame, self._pose(X))
        return result

    def ask(self, k: int, kinds: tuple[str, ...]) -> Any:
        """See Engine."""
        self._port.FixValue(self._context, self._sets[k])
        return {kind: self._renders[kind]() for kind in kinds}

    def depth(self, answer: Any) -> np.ndarray:
        """See Engine."""
        return np.asarray(answer["depth"].data, np.float64)[..., 0]

    def close(self) -> None:
        """See Engine."""


class DrakeVtk(_Drake):
    """RenderEngineVtk."""

    name = "Drake, VTK"

    def _engine(self, drake: Any) -> Any:
        return drake.MakeRenderEngineVtk(drake.RenderEngineVtkParams())


class DrakeGl(_Drake):
    """RenderEngineGl; raises RuntimeError without an X display."""

    name = "Drake, GL"

    def _engine(self, drake: Any) -> Any:
        return drake.MakeRenderEngineGl(drake.RenderEngineGlParams())
