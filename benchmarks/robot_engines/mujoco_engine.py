"""MuJoCo: ``mj_kinematics`` and ``mj_collision``, called from Python for each configuration."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import add_mujoco_geom
from benchmarks.robot_engines.robot_world import RobotWorld, samples_of
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = ["MuJoCoEngine"]


class MuJoCoEngine:
    """A model of hinges and slides. Contacts are found without a margin."""

    name = "MuJoCo"

    def __init__(self, world: RobotWorld) -> None:
        self._world, self._mujoco = world, importlib.import_module("mujoco")
        mujoco: Any = self._mujoco
        spec = mujoco.MjSpec()
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        # Whoever may touch is said below.
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_FILTERPARENT
        bodies = [spec.worldbody]
        for name, turns, parent, X in world.placed_joints():
            body = self._add_body(bodies[parent], name, X)
            kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
            body.add_joint(name=f"joint {name}", type=kind, axis=[0.0, 0.0, 1.0])
            bodies.append(body)
        # A body for each geometry, as pairs of bodies are left out, not of geometries.
        for k, thing in enumerate(world.things):
            body = self._add_body(bodies[thing.joint], f"thing_{k}", thing.X)
            add_mujoco_geom(spec, body, thing.shape, f"geom_{k}", _place(np.eye(4)))
        for a, b in world.excluded:
            spec.add_exclude(bodyname1=f"thing_{a}", bodyname2=f"thing_{b}")
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)

    @staticmethod
    def _add_body(parent: Any, name: str, X: np.ndarray) -> Any:
        return parent.add_body(
            name=name, mass=1.0, inertia=[1.0] * 3, explicitinertial=True, **_place(X)
        )

    def collide(self, q: np.ndarray) -> np.ndarray:
        """See RobotEngine."""
        return np.array([self.collides(each) for each in self._world.all_positions(q)])

    def collides(self, positions: np.ndarray) -> bool:
        """Tell whether the positions ``(j,)`` of all joints collide."""
        model, data = self._model, self._data
        data.qpos[:] = positions
        self._mujoco.mj_kinematics(model, data)
        self._mujoco.mj_collision(model, data)
        return bool(data.ncon > 0)

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine."""
        result = np.zeros(len(edges), dtype=np.bool_)
        for k, edge in enumerate(edges):
            positions = self._world.all_positions(samples_of(edge, step))
            result[k] = any(map(self.collides, positions))
        return result


def _place(X: np.ndarray) -> dict[str, Any]:
    quaternion = quaternions_from_poses(np.ascontiguousarray(X[np.newaxis]))[0, [3, 0, 1, 2]]
    return {"pos": X[:3, 3], "quat": quaternion}
