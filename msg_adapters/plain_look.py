"""The marker of a geometry that needs no triangles, as a few numbers."""

from __future__ import annotations

from typing import NamedTuple

from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

__all__ = ["PlainLook"]


class PlainLook(NamedTuple):
    """All that plain markers differ in, but their poses and stamps; sizes in metres."""

    ns: str
    id: int
    type: int
    action: int
    size: tuple[float, float, float]
    color: tuple[float, float, float, float]

    def marker(self, frame_id: str) -> Marker:
        """Return the message."""
        x, y, z = self.size
        r, g, b, a = self.color
        return Marker(
            header=Header(frame_id=frame_id),
            ns=self.ns,
            id=self.id,
            type=self.type,
            action=self.action,
            scale=Vector3(x=x, y=y, z=z),
            color=ColorRGBA(r=r, g=g, b=b, a=a),
        )
