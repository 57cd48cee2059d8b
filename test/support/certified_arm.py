"""An arm of two joints between a ball and a box, and a box of tangents in which it is free."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from robot_scenes import ARM, diagram, POSTS

from scene_graph_ros.planning import (
    CspaceFreePolytope,
    PolytopeCertificate,
    SceneGraphCollisionChecker,
)

__all__ = ["BOX", "arm_between_posts", "free_box"]

BOX = np.concatenate([np.eye(2), -np.eye(2)])
"""The rows of a box of tangents."""


def arm_between_posts(folder: Path) -> SceneGraphCollisionChecker:
    """Return the checker of the arm, whose files are written to a folder."""
    return SceneGraphCollisionChecker(diagram(folder, ARM, POSTS))


def free_box(arm: SceneGraphCollisionChecker) -> PolytopeCertificate:
    """Return what is shown of a box in which the arm is free."""
    search = CspaceFreePolytope(arm)
    found = search.find_separation_certificate_given_polytope(BOX, np.full(4, 0.15))
    assert found.is_success, found.failures
    return found
