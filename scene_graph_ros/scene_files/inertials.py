"""Read a link's mass and inertia from a URDF."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.robots.robot_parts import Inertial
from scene_graph_ros.scene_files.xml_tree import XmlElement

__all__ = ["inertial_of"]


def inertial_of(link: XmlElement) -> Inertial | None:
    """Return a link's inertia, None without ``<inertial>``.

    Inertias of no mass, and ones that no body has, are taken as they are said: files that are in
    use have them. Raises SceneFileError for a negative mass, and for numbers that are missing.
    """
    element = link.only_child("inertial")
    if element is None:
        return None
    mass = element.required_child("mass").number("value")
    if mass < 0.0:
        raise element.required_child("mass").error(f"must not be negative, got {mass:g}", "value")
    tensor = element.required_child("inertia")
    xx, xy, xz, yy, yz, zz = (
        tensor.number(name) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    origin = element.only_child("origin")
    X_LI = np.eye(4)
    if origin is not None:
        X_LI = pose_from_xyz_rpy(
            origin.numbers("xyz", 3, "0 0 0"), origin.numbers("rpy", 3, "0 0 0")
        )
    R_LI = X_LI[:3, :3]
    I_I = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Inertial(mass, X_LI[:3, 3], product(product(R_LI, I_I), R_LI.T))
