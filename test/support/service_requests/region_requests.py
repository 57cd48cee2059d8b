"""Good requests about regions of the world."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point
import numpy as np

from scene_graph_msgs.msg import GeometrySet, QueryOptions, Region
from service_requests.small_world import BALL, WHAT_IF

__all__ = ["REQUESTS"]

CUBE_NORMALS = [float(v) for v in np.concatenate([np.eye(3), -np.eye(3)]).ravel()]

REQUESTS: dict[str, dict[str, Any]] = {
    "CheckRegions": {
        "options": QueryOptions(what_if=WHAT_IF),
        "names": ["kept"],
        "regions": [Region(name="cube", a=CUBE_NORMALS, b=[1.0] * 6)],
    },
    "GrowRegion": {
        "seed": Point(x=2.0, z=1.0),
        "domain_min": Point(x=1.0, y=-1.0, z=-1.0),
        "domain_max": Point(x=3.0, y=1.0, z=2.0),
        "domain_a": [1.0, 1.0, 0.0],
        "domain_b": [3.5],
        "ignored": GeometrySet(geometries=[BALL]),
        "name": "grown",
    },
    "LoadRegions": {
        "text": "a: {A: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], b: [1, 1, 1, 0]}",
        "prefix": "p_",
    },
    "RemoveRegions": {"names": ["kept"]},
    "SaveRegions": {"names": ["kept"], "child_name": "all"},
}
"""Fields by the type of the request."""
