"""Good requests that change the scene."""

from __future__ import annotations

from typing import Any

from scene_requests import pose, sphere

from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    DeformableGeometryDescription,
    FrameDescription,
    GeometrySet,
    Property,
    RoleProperties,
)
from service_requests.small_world import BALL, BOX, OWNER, SCENE

__all__ = ["REQUESTS"]

REQUESTS: dict[str, dict[str, Any]] = {
    "ApplyCollisionFilter": {
        "source": OWNER,
        "statements": [
            CollisionFilterStatement(
                operation=1, a=GeometrySet(geometries=[BALL]), b=GeometrySet(frames=["hand"])
            )
        ],
        "is_transient": True,
    },
    "AssignRole": {
        "source": OWNER,
        "geometries": [BALL],
        "role": RoleProperties(
            role=1, properties=[Property(group="a", name="b", type=2, doubles=[1.0])]
        ),
        "assign": 1,
    },
    "LoadScene": {"text": SCENE.replace("arm", "leg").replace("table", "desk"), "prefix": "p_"},
    "RegisterAnchoredGeometry": {
        "source": OWNER,
        "geometries": [sphere("lamp", at=pose(x=1.0))],
    },
    "RegisterDeformableGeometry": {
        "source": OWNER,
        "geometries": [
            DeformableGeometryDescription(geometry=sphere("soft"), resolution_hint=[0.3])
        ],
    },
    "RegisterFrame": {"source": OWNER, "frames": [FrameDescription(name="tip", pose=pose())]},
    "RegisterGeometry": {
        "source": OWNER,
        "frame": "hand",
        "geometries": [sphere("knob", at=pose(x=0.1))],
    },
    "RegisterSource": {"name": "third", "token": 3},
    "RemoveCollisionFilter": {"source": OWNER, "filter_id": 1},
    "RemoveFrame": {"source": OWNER, "frames": ["hand"]},
    "RemoveGeometry": {"source": OWNER, "geometries": [BOX]},
    "RemoveRole": {"source": OWNER, "geometries": [BALL], "role": 1},
    "RemoveSource": {"source": OWNER},
}
"""Fields by the type of the request."""
