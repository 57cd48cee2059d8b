"""Imported, this calls a kernel: numba has read all that it reads before the first one."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.spatial.pose_kernels import check_poses

__all__: list[str] = []

check_poses(np.eye(4)[np.newaxis])
