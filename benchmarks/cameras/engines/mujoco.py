"""MuJoCo's renderer: bodies that are moved by ``mocap_pos``, software GL by EGL."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.cameras.engines.engine import distinct_colors, KINDS
from benchmarks.cameras.scenes import CameraScene, CLIPPING
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, Mesh
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = ["MuJoCo"]

_ALONG_Z = [0.0, 1.0, 0.0, 0.0]
"""A half turn about x: MuJoCo's cameras look along -z, with y up."""


class MuJoCo:
    """``mujoco.Renderer``; of a camera it knows the angle of view, no centre beside the middle."""

    name = "MuJoCo"
    kinds = KINDS

    def __init__(self, scene: CameraScene, lens: CameraIntrinsics) -> None:
        mujoco: Any = importlib.import_module("mujoco")
        self._mujoco = mujoco
        spec = mujoco.MjSpec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = lens.width, lens.height
        # Both are parts of the extent of the model.
        spec.stat.extent = 1.0
        spec.visual.map.znear, spec.visual.map.zfar = CLIPPING.near, CLIPPING.far
        fov_y = 2.0 * np.degrees(np.arctan(0.5 * lens.height / lens.fy))
        spec.worldbody.add_camera(name="eye", quat=_ALONG_Z, fovy=fov_y)
        colors = distinct_colors(len(scene.shapes))
        known: dict[int, str] = {}
        for k, (shape, color) in enumerate(zip(scene.shapes, colors, strict=True)):
            body = spec.worldbody.add_body(name=f"body_{k}", mocap=True)
            seen = {"rgba": [*color.tolist(), 1.0], "contype": 0, "conaffinity": 0}
            body.add_geom(**self._geom(spec, shape, known), **seen)
        try:
            self._model = spec.compile()
        except ValueError as error:
            raise RuntimeError(f"its compiler of models says: {error}") from error
        self._data = mujoco.MjData(self._model)
        quaternions = quaternions_from_poses(scene.X_WGs.reshape(-1, 4, 4))[:, [3, 0, 1, 2]]
        self._quaternions = quaternions.reshape(*scene.X_WGs.shape[:2], 4)
        self._positions = np.ascontiguousarray(scene.X_WGs[..., :3, 3])
        count = len(scene.shapes) + 10
        self._renderer = mujoco.Renderer(self._model, lens.height, lens.width, max_geom=count)

    def _geom(self, spec: Any, shape: Any, known: dict[int, str]) -> dict[str, Any]:
        types = self._mujoco.mjtGeom
        match shape:
            case Mesh():
                if id(shape) not in known:
                    known[id(shape)] = name = f"mesh_{len(known)}"
                    vertices, faces = np.asarray(shape.vertices), np.asarray(shape.faces)
                    spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.ravel())
                return {"type": types.mjGEOM_MESH, "meshname": known[id(shape)]}
            case Box():
                return {"type": types.mjGEOM_BOX, "size": 0.5 * shape.size}
            case Ellipsoid():
                return {"type": types.mjGEOM_ELLIPSOID, "size": [shape.a, shape.b, shape.c]}
            case Capsule():
                size = [shape.radius, 0.5 * shape.length, 0.0]
                return {"type": types.mjGEOM_CAPSULE, "size": size}
            case Cylinder():
                size = [shape.radius, 0.5 * shape.length, 0.0]
                return {"type": types.mjGEOM_CYLINDER, "size": size}
        return {"type": types.mjGEOM_SPHERE, "size": [shape.radius, 0.0, 0.0]}

    def ask(self, k: int, kinds: tuple[str, ...]) -> Any:
        """See Engine."""
        self._data.mocap_pos[:], self._data.mocap_quat[:] = (
            self._positions[k],
            self._quaternions[k],
        )
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, "eye")
        return {kind: self._render(kind) for kind in kinds}

    def _render(self, kind: str) -> np.ndarray:
        renderer = self._renderer
        if kind == "color":
            return renderer.render()
        is_depth = kind == "depth"
        (renderer.enable_depth_rendering if is_depth else renderer.enable_segmentation_rendering)()
        image = renderer.render()
        (
            renderer.disable_depth_rendering
            if is_depth
            else renderer.disable_segmentation_rendering
        )()
        return image

    def depth(self, answer: Any) -> np.ndarray:
        """See Engine; where nothing is, its depth is that of the far plane."""
        depth = np.asarray(answer["depth"], np.float64)
        return np.where(depth < 0.999 * CLIPPING.far, depth, np.inf)

    def close(self) -> None:
        """See Engine."""
        self._renderer.close()
