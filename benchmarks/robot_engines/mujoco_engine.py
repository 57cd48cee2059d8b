"""MuJoCo: ``mj_kinematics`` and ``mj_collision``, called from Python for each configuration."""

from __future__ import annotations

from collections.abc import Callable
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
        bodies, held, left_out = [spec.worldbody], {}, set()
        for name, turns, parent, X in world.placed_joints():
            body = self._add_body(bodies[parent], name, X)
            kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
            body.add_joint(name=f"joint {name}", type=kind, axis=[0.0, 0.0, 1.0])
            bodies.append(body)
        # Pairs of bodies are left out, not of geometries: one body for those that a joint moves
        # alike and that may touch the same.
        names: dict[tuple[int, bytes], str] = {}
        body_of: list[str] = []
        for k, (thing, row) in enumerate(zip(world.things, _may_touch(world), strict=True)):
            key = thing.joint, row.tobytes()
            if key not in names:
                names[key] = f"body_{len(names)}"
                held[names[key]] = self._add_body(bodies[thing.joint], names[key], np.eye(4))
            body_of.append(names[key])
            add_mujoco_geom(spec, held[names[key]], thing.shape, f"geom_{k}", _place(thing.X))
        for first, second in sorted({(body_of[a], body_of[b]) for a, b in world.excluded}):
            if first != second and (second, first) not in left_out:
                spec.add_exclude(bodyname1=first, bodyname2=second)
                left_out.add((first, second))
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self.qpos = self._data.qpos
        """``(j,)``: the positions of all joints, to be written to."""
        self._touches = self.new_check()

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
        self.qpos[:] = positions
        return self._touches()

    def new_check(self) -> Callable[[], bool]:
        """Return what tells whether ``qpos`` collides: two calls of MuJoCo, and nothing else."""
        model, data = self._model, self._data
        place, collide = self._mujoco.mj_kinematics, self._mujoco.mj_collision

        def touches() -> bool:
            place(model, data)
            collide(model, data)
            return bool(data.ncon)

        return touches

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine."""
        result = np.zeros(len(edges), dtype=np.bool_)
        for k, edge in enumerate(edges):
            positions = self._world.all_positions(samples_of(edge, step))
            result[k] = any(map(self.collides, positions))
        return result


def _may_touch(world: RobotWorld) -> np.ndarray:
    """Return ``(k, k)``: whether two things are a pair that may not touch each other."""
    result = np.zeros((len(world.things), len(world.things)), dtype=np.bool_)
    a, b = world.pairs.T
    result[a, b] = result[b, a] = True
    return result


def _place(X: np.ndarray) -> dict[str, Any]:
    quaternion = quaternions_from_poses(np.ascontiguousarray(X[np.newaxis]))[0, [3, 0, 1, 2]]
    return {"pos": X[:3, 3], "quat": quaternion}
