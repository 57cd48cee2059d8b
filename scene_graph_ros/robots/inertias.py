"""The masses that a robot's joints move, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.robot_parts import RobotParts
from scene_graph_ros.robots.tree_joint import KinematicTreeError

__all__ = ["TreeInertias", "tree_inertias"]


@one_line()
@dataclass(frozen=True, eq=False)
class TreeInertias:
    """Masses of a tree's links, and those that each joint moves; 0 of links without one.

    ``link_masses`` ``(l,)`` in kg, ``p_LI`` ``(l, 3)`` their centres of mass in their frames.
    Of joints, whose row 0 is the base: ``masses`` ``(j + 1,)``, ``moments`` ``(j + 1, 3)`` (mass
    times centre of mass, kg m) and ``inertias`` ``(j + 1, 3, 3)`` about the joint's origin, kg
    m^2, all in its frame J and of all links that it moves itself.
    """

    tree: KinematicTree
    link_masses: NDArray[np.float64]
    p_LI: NDArray[np.float64]
    masses: NDArray[np.float64]
    moments: NDArray[np.float64]
    inertias: NDArray[np.float64]

    @property
    def total_mass(self) -> float:
        """The mass of all links, kg."""
        return float(self.link_masses.sum())

    def centre_of_mass(self, q: ArrayLike) -> NDArray[np.float64]:
        """Return the centre of mass in W, m: ``(n, 3)``, or ``(3,)`` of one configuration.

        Raises KinematicTreeError for bad configurations, and where no link has a mass.
        """
        if not self.total_mass > 0.0:
            raise KinematicTreeError(f"no link of robot {self.tree.name!r} has a mass")
        X_WL = self.tree.link_poses(q)
        p_WI = X_WL[..., :3, 3] + np.einsum("...lij,lj->...li", X_WL[..., :3, :3], self.p_LI)
        result: NDArray[np.float64] = (
            product(self.link_masses[np.newaxis], p_WI)[..., 0, :] / self.total_mass
        )
        return result


def tree_inertias(model: RobotParts, tree: KinematicTree) -> TreeInertias:
    """Return the masses of a robot's links, and those that the joints of its tree move."""
    count = len(tree.joints) + 1
    masses, moments, inertias = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    link_masses, p_LI = np.zeros(len(tree.link_names)), np.zeros((len(tree.link_names), 3))
    for row, name in enumerate(tree.link_names):
        inertial = model.links[name].inertial
        if inertial is None:
            continue
        joint, X_JL = tree.joint_of_link[row], tree.X_JL[row]
        R_JL, mass = X_JL[:3, :3], inertial.mass
        p_JI = X_JL[:3, 3] + product(R_JL, inertial.p_LI)
        link_masses[row], p_LI[row] = mass, inertial.p_LI
        masses[joint] += mass
        moments[joint] += mass * p_JI
        # Steiner: from the centre of mass to J's origin.
        inertias[joint] += product(product(R_JL, inertial.I_L), R_JL.T)
        inertias[joint] += mass * (product(p_JI, p_JI) * np.eye(3) - np.outer(p_JI, p_JI))
    return TreeInertias(tree, link_masses, p_LI, masses, moments, inertias)
