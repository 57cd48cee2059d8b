"""Drake's certificates of the same boxes, by the solver that comes with it: Clarabel."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common import Parallelism
from pydrake.geometry import Box, Sphere
from pydrake.geometry.optimization import (
    CspaceFreePolytope,
    SeparatingPlaneOrder,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.solvers import ClarabelSolver
from pydrake.systems.framework import DiagramBuilder

__all__ = ["DrakeSearch"]


class DrakeSearch:
    """Drake's search for the arm of a URDF between a ball and a box."""

    def __init__(self, urdf: str) -> None:
        """Build plant and search."""
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        Parser(plant).AddModelsFromString(urdf, "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link0"))
        friction = CoulombFriction(1.0, 1.0)
        for name, shape, place in (
            ("ball", Sphere(0.2), [1.2, 0.9, 0.0]),
            ("box", Box(0.4, 0.4, 0.4), [-0.9, -0.9, 0.0]),
        ):
            plant.RegisterCollisionGeometry(
                plant.world_body(), RigidTransform(place), shape, name, friction
            )
        plant.Finalize()
        self._diagram = builder.Build()
        self._n = plant.num_positions()
        self._search = CspaceFreePolytope(
            plant, scene_graph, SeparatingPlaneOrder.kAffine, np.zeros(self._n)
        )
        self.num_pairs = len(self._search.separating_planes())

    def certify(self, width: float) -> bool:
        """Tell whether a box of s about zero is certified, in one thread."""
        options: Any = CspaceFreePolytope.FindSeparationCertificateGivenPolytopeOptions()
        options.solver_id = ClarabelSolver.id()
        options.parallelism = Parallelism(1)
        C = np.concatenate([np.eye(self._n), -np.eye(self._n)])
        success, _ = self._search.FindSeparationCertificateGivenPolytope(
            C, np.full(2 * self._n, width), set(), options
        )
        return bool(success)
