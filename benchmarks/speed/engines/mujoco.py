"""MuJoCo: a model of free bodies made with MjSpec, moved by ``qpos``."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import add_mujoco_geom
from benchmarks.speed.scenes import Scene, WORLD
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = ["MuJoCo"]

_ARENA = 2 << 30
"""Bytes for contacts and what the compiler of models computes about them."""


def _wxyz(X: np.ndarray) -> np.ndarray:
    """Return MuJoCo's quaternions (n, 4) of poses (n, 4, 4)."""
    return quaternions_from_poses(np.ascontiguousarray(X))[:, [3, 0, 1, 2]]


class MuJoCo:
    """``mj_kinematics`` and ``mj_collision``. It reports contacts up to a margin."""

    name = "MuJoCo"

    def __init__(self, scene: Scene) -> None:
        self._mujoco: Any = importlib.import_module("mujoco")
        spec = self._mujoco.MjSpec()
        spec.memory = _ARENA
        spec.compiler.inertiafromgeom = self._mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        bodies = []
        for k in range(scene.frames):
            body = spec.worldbody.add_body(
                name=f"frame_{k}", mass=1.0, inertia=[1.0] * 3, explicitinertial=True
            )
            body.add_freejoint()
            bodies.append(body)
        for k, b in enumerate(scene.bodies):
            parent = spec.worldbody if b.frame == WORLD else bodies[b.frame]
            place = {"pos": b.X_FG[:3, 3], "quat": _wxyz(b.X_FG[None])[0]}
            add_mujoco_geom(spec, parent, b.shape, f"geometry_{k}", place)
        for f, g in sorted(scene.excluded):
            spec.add_exclude(bodyname1=f"frame_{f}", bodyname2=f"frame_{g}")
        self._model = spec.compile()
        self._data = self._mujoco.MjData(self._model)
        self.choose(scene.X_WF, 0.0)

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine."""
        m, f = X_WFs.shape[:2]
        self._qpos = np.empty((m, f, 7))
        self._qpos[..., :3] = X_WFs[..., :3, 3]
        self._qpos[..., 3:] = _wxyz(X_WFs.reshape(-1, 4, 4)).reshape(m, f, 4)
        self._qpos = self._qpos.reshape(m, -1)
        self._model.geom_margin[:] = 0.5 * max_distance  # those of a pair are added

    def move(self, k: int) -> None:
        """See Engine."""
        self._data.qpos[:] = self._qpos[k % len(self._qpos)]
        self._mujoco.mj_kinematics(self._model, self._data)

    def penetrations(self) -> Any:
        """Return the number of contacts, several for some pairs."""
        self._mujoco.mj_collision(self._model, self._data)
        return self._data.ncon

    def distances(self, max_distance: float) -> Any:
        """Return the number of contacts within the margin chosen before."""
        del max_distance
        return self.penetrations()

    def collides(self) -> Any:
        """Return the number of contacts: there is no way to stop at the first."""
        return self.penetrations()

    def count(self, row: str, result: Any) -> int:
        """See Engine; the pairs of geoms are counted."""
        if row == "collides":
            return int(result > 0)
        return len(np.unique(np.sort(self._data.contact.geom, axis=1), axis=0))
