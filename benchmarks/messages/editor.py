"""Changes the scene of the node as it is told, and notes when each change began and was answered.

Reads lines with a request of ``REQUESTS`` and an argument, ``{"what": name, "with": text}``, and
answers each with ``{"begin": ns, "end": ns}`` of the system's clock.
"""

from __future__ import annotations

from collections.abc import Callable
import json
import sys
import time
from typing import Any

from geometry_msgs.msg import Pose, Quaternion
import rclpy
from rclpy.signals import SignalHandlerOptions

from scene_graph_msgs.msg import (
    GeometryDescription,
    GeometryReference,
    Property,
    RoleProperties,
    Shape,
)
from scene_graph_msgs.srv import (
    LoadScene,
    RegisterAnchoredGeometry,
    RegisterSource,
    RemoveGeometry,
)

__all__ = ["COUNT", "REQUESTS"]

COUNT = 3
"""Geometries that are registered or removed at once."""

_ANSWER_SECONDS = 300.0
_AWAY = 100.0
"""Metres from the scene: what is registered touches nothing."""


def _geometry(name: str, shape: Shape, place: float) -> GeometryDescription:
    """Return a geometry that collides and is shown."""
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x = pose.position.z = _AWAY + place
    roles = (RoleProperties.PROXIMITY, RoleProperties.ILLUSTRATION)
    return GeometryDescription(
        name=name, shape=shape, pose=pose, roles=[RoleProperties(role=role) for role in roles]
    )


def _register(source: Any, _: str) -> tuple[Any, Any]:
    shape = Shape(kind=Shape.SPHERE, dimensions=[0.1])
    extra = [_geometry(f"extra_{i}", shape, float(i)) for i in range(COUNT)]
    return RegisterAnchoredGeometry, {"source": source, "geometries": extra}


def _remove(source: Any, _: str) -> tuple[Any, Any]:
    names = [GeometryReference(name=f"extra_{i}") for i in range(COUNT)]
    return RemoveGeometry, {"source": source, "geometries": names}


def _register_mesh(source: Any, path: str) -> tuple[Any, Any]:
    mesh = _geometry("mesh", Shape(kind=Shape.MESH, resource=path), 20.0)
    return RegisterAnchoredGeometry, {"source": source, "geometries": [mesh]}


def _register_soft(source: Any, _: str) -> tuple[Any, Any]:
    ball = _geometry("soft", Shape(kind=Shape.SPHERE, dimensions=[0.1]), 40.0)
    values = {"resolution_hint": 0.05, "hydroelastic_modulus": 1e5}
    ball.roles[0].properties = [
        Property(group="hydroelastic", name=name, type=Property.DOUBLE, doubles=[value])
        for name, value in values.items()
    ]
    kind = Property(
        group="hydroelastic", name="compliance_type", type=Property.STRING, strings=["compliant"]
    )
    ball.roles[0].properties = [*ball.roles[0].properties, kind]
    return RegisterAnchoredGeometry, {"source": source, "geometries": [ball]}


def _load(source: Any, path: str) -> tuple[Any, Any]:
    return LoadScene, {"resource": path}


REQUESTS: dict[str, Callable[[Any, str], tuple[Any, Any]]] = {
    "register": _register,
    "remove": _remove,
    "mesh": _register_mesh,
    "soft": _register_soft,
    "load": _load,
}
"""What the editor can be told: the request's type and fields, for a source and an argument."""


class _Editor:
    """Calls the node's services, one request at a time."""

    def __init__(self) -> None:
        self._node = rclpy.create_node("editor")
        self._clients: dict[Any, Any] = {}
        self.source = self.call(RegisterSource, {"name": "editor"})[0].source

    def call(self, kind: Any, fields: dict[str, Any]) -> tuple[Any, int, int]:
        """Return the response, and when the request was sent and answered."""
        client = self._clients.get(kind)
        if client is None:
            name = kind.__name__
            words = "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
            client = self._clients[kind] = self._node.create_client(kind, f"/scene_graph/{words}")
            client.wait_for_service(_ANSWER_SECONDS)
        request = kind.Request(**fields)
        begin = time.time_ns()
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self._node, future, timeout_sec=_ANSWER_SECONDS)
        end = time.time_ns()
        if not future.done() or future.result().status.code:
            raise RuntimeError(f"{kind}: {future.result() if future.done() else 'no answer'}")
        return future.result(), begin, end


def main() -> None:
    """Change the scene as standard input says, until it ends."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    editor = _Editor()
    for line in sys.stdin:
        order = json.loads(line)
        kind, fields = REQUESTS[order["what"]](editor.source, order["with"])
        _, begin, end = editor.call(kind, fields)
        sys.stdout.write(json.dumps({"begin": begin, "end": end}) + "\n")
        sys.stdout.flush()
    rclpy.shutdown()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
