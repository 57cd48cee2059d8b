"""Good requests that ask about the world, and change nothing."""

from __future__ import annotations

from typing import Any

from scene_graph_msgs.msg import QueryOptions
from service_requests.small_world import BALL, BOX, WHAT_IF

__all__ = ["REQUESTS"]

REQUESTS: dict[str, dict[str, Any]] = {
    "ComputePointPairPenetration": {"options": QueryOptions(what_if=WHAT_IF)},
    "ComputeSignedDistancePair": {"geometries_a": ["ball"], "geometries_b": ["box"]},
    "ComputeSignedDistancePairwise": {"max_distance": [1.0]},
    "ComputeSignedDistanceToPoint": {"points": [0.1, 0.2, 0.3], "threshold": [1.0]},
    "DescribeScene": {"with_shapes": True, "with_properties": True},
    "FindCollisionCandidates": {},
    "GetDeformableConfigurations": {},
    "GetPoseInWorld": {"frames": ["base"], "geometries": [BALL]},
    "HasCollisions": {},
    "IsCollisionFiltered": {"a": [BALL], "b": [BOX]},
}
"""Fields by the type of the request."""
