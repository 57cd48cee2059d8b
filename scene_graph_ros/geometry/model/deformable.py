"""Deformable geometries of the model: their reference meshes, and where their vertices are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.derived import DerivedValues
from scene_graph_ros.geometry.spatial.sums import moved

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

__all__ = ["DEFORMABLE_GROUP", "Configuration", "Deformable"]

DEFORMABLE_GROUP = "deformable"
"""The properties of a role that say what a deformable geometry carries along."""


class Configuration:
    """Where the vertices of a deformable geometry are, at one moment. It never changes."""

    __slots__ = ("deformable", "derived_for_good", "q_WG")

    def __init__(self, deformable: Deformable, q_WG: NDArray[np.float64]) -> None:
        """Take positions ``(v, 3)``, in m, that nobody writes to any more."""
        q_WG.flags.writeable = False
        self.deformable = deformable
        self.q_WG = q_WG
        self.derived_for_good = DerivedValues()


class Deformable:
    """The record of a deformable geometry beside that of every geometry.

    It never changes.
    """

    __slots__ = ("derived_for_good", "mesh", "reference")

    def __init__(self, mesh: VolumeMesh, X_WG: NDArray[np.float64]) -> None:
        """Take a mesh in G, and where G is in the world: the configuration to begin with."""
        self.mesh = mesh
        self.reference = Configuration(self, moved(mesh.vertices, X_WG))
        self.derived_for_good = DerivedValues()
