"""Where a frame that is fixed to a link of a robot is to be."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.poses import as_pose

__all__ = ["InverseKinematicsError", "PoseTarget"]


class InverseKinematicsError(SceneGraphError, ValueError):
    """Targets, or arguments of a search for them, that make no sense."""


@one_line()
@dataclass(frozen=True, eq=False)
class PoseTarget:
    """A tool T, fixed to ``link`` at ``X_LT``, is to be at ``X_WT``, both ``(4, 4)``.

    Its origin may be off by ``position_tolerance`` (m), and it may be turned by
    ``rotation_tolerance`` (rad); pi leaves its orientation open. Raises InvalidPoseError for a
    matrix that is no rigid pose, InverseKinematicsError for a tolerance that is not a positive
    number.
    """

    link: str
    X_WT: NDArray[np.float64]
    X_LT: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    position_tolerance: float = 1e-9
    rotation_tolerance: float = 1e-9

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        for name in ("X_WT", "X_LT"):
            object.__setattr__(self, name, as_pose(getattr(self, name), f"{name} of a target"))
        for name in ("position_tolerance", "rotation_tolerance"):
            number = as_float(getattr(self, name))
            if number is None or not 0.0 < number < math.inf:
                raise InverseKinematicsError(
                    f"{name} must be a positive number, not {quoted(getattr(self, name))}"
                )
            object.__setattr__(self, name, number)
