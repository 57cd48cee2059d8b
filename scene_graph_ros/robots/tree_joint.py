"""One joint of a kinematic tree, and the names of its positions and velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = ["PARTS", "KinematicTreeError", "TreeJoint"]

PARTS = {
    REVOLUTE: ((),) * 2,
    PRISMATIC: ((),) * 2,
    PLANAR: (("x", "y", "theta"), ("x", "y", "theta")),
    FLOATING: (("qw", "qx", "qy", "qz", "x", "y", "z"), ("wx", "wy", "wz", "vx", "vy", "vz")),
}
"""What is put after a joint's name where it has several positions, and several velocities."""


class KinematicTreeError(SceneGraphError, ValueError):
    """Configurations, links or names that do not fit a tree."""


@one_line()
@dataclass(frozen=True, eq=False)
class TreeJoint:
    """A joint that moves. It turns about, or slides along, the z axis of its frame J.

    ``kind`` is one of ``tree_kernels``. ``X_PJ`` ``(4, 4)`` places J, at position zero, in the
    frame of the joint ``parent`` (a row of the tree; 0 is the base). A joint that mimics has the
    name of the joint it follows: it is at ``multiplier * position + offset``. ``velocity`` is the
    largest speed of a joint with one position, rad/s or m/s, and so on.
    """

    name: str
    kind: int
    parent: int
    X_PJ: NDArray[np.float64]
    lower: float = -np.inf
    upper: float = np.inf
    mimics: str = ""
    multiplier: float = 1.0
    offset: float = 0.0
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
