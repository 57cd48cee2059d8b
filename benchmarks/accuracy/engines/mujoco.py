"""MuJoCo, all shapes as geoms of one model."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Refused, Reply, timed
from benchmarks.peer_shapes import mujoco_geom
from scene_graph_ros.geometry import HalfSpace

__all__ = ["MuJoCo"]

_FAR = 1.0
"""Metres: distances beyond it are not asked for."""


def _body(name: str, shape: Any, X_WG: np.ndarray, is_free: bool, assets: list[str]) -> str:
    """Return the XML of a body with one geom, and add the mesh that it needs to the assets."""
    form, asset = mujoco_geom(shape, name)
    assets.append(asset)
    x, y, z, w = Rotation.from_matrix(X_WG[:3, :3]).as_quat().tolist()
    p = " ".join(map(repr, X_WG[:3, 3].tolist()))
    joint = "<freejoint/>" if is_free else ""
    place = f'pos="{p}" quat="{w!r} {x!r} {y!r} {z!r}"'
    geom = f'<geom name="{name}" contype="0" conaffinity="0" {form}/>'
    return f"<body {place}>{joint}{geom}</body>"


class MuJoCo:
    """``mj_geomDistance`` and ``mj_collision``, with MuJoCo's tolerance or a given one."""

    def __init__(self, tolerance: float | None = None) -> None:
        self.name = "MuJoCo" if tolerance is None else f"MuJoCo, tolerance {tolerance:.0e}"
        self._mujoco: Any = importlib.import_module("mujoco")
        self._option = ""
        if tolerance is not None:
            self._option = f'<option ccd_tolerance="{tolerance!r}" ccd_iterations="1000"/>'

    def _model(self, pairs: Sequence[KnownPair]) -> tuple[Any, Any]:
        """Return model and data; bodies and geoms 2k and 2k + 1 are the k-th pair."""
        bodies, assets, contacts = [], [], []
        for k, pair in enumerate(pairs):
            # Geoms that can't move are never in contact with each other, so one is free to.
            is_A_free = not isinstance(pair.shape_A, HalfSpace)
            bodies.append(_body(f"a{k}", pair.shape_A, pair.X_WA, is_A_free, assets))
            bodies.append(_body(f"b{k}", pair.shape_B, pair.X_WB, not is_A_free, assets))
            contacts.append(f'<pair geom1="a{k}" geom2="b{k}"/>')
        text = (
            f"<mujoco>{self._option}<asset>{''.join(assets)}</asset>"
            f"<worldbody>{''.join(bodies)}</worldbody>"
            f"<contact>{''.join(contacts)}</contact></mujoco>"
        )
        model = self._mujoco.MjModel.from_xml_string(text)
        data = self._mujoco.MjData(model)
        self._mujoco.mj_kinematics(model, data)
        return model, data

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        model, data = self._model(pairs)
        line = np.zeros(6)
        distance = self._mujoco.mj_geomDistance

        def ask(a: int, b: int) -> float:
            return distance(model, data, a, b, _FAR, line)

        try:
            return one_by_one(ask, [(2 * k, 2 * k + 1) for k in range(len(pairs))])
        except (self._mujoco.FatalError, ValueError) as error:
            raise Refused(str(error)) from error

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; one call for the whole model, the deepest of a pair's contacts counts."""
        model, data = self._model(pairs)
        _, seconds = timed(lambda: self._mujoco.mj_collision(model, data))
        values = np.zeros(len(pairs))
        np.minimum.at(values, data.contact.geom[:, 0] // 2, data.contact.dist)
        return Reply(values, seconds / len(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """Refuse: MuJoCo has no query for points."""
        raise Refused("no query for points")
