"""Good requests about cameras and their images."""

from __future__ import annotations

from typing import Any

from scene_requests import camera

from scene_graph_msgs.msg import RendererDescription
from service_requests.small_world import OWNER

__all__ = ["REQUESTS"]

REQUESTS: dict[str, dict[str, Any]] = {
    "RegisterCamera": {
        "source": OWNER,
        "cameras": [camera("nose", "hand", renderer="red")],
        "renderers": [
            RendererDescription(name="red", type="exact", parameters="default_diffuse: [1, 0, 0]")
        ],
    },
    "RemoveCamera": {"source": OWNER, "cameras": ["eye"]},
    "RenderImages": {
        "camera": "eye",
        "images": ["color", "depth", "label"],
        "renderer": RendererDescription(type="exact", parameters="default_diffuse: [1, 0, 0]"),
    },
}
"""Fields by the type of the request."""
