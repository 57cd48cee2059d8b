"""The points of a sensor's newest image or cloud, without the robot's, for others.

Imported while the scene has a source that says how its sensor is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import PointCloud2

from msg_adapters.point_clouds import sensed_points_to_msg
from scene_graph_ros.node.effects.declarations import SensedSource
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.names import SENSED
from scene_graph_ros.node.runtime.qos import image_qos
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["SensedPoints"]


class SensedPoints:
    """Publishes each message's points once, in the world frame and stamped as the message."""

    def __init__(self, host: Host, source: SensedSource) -> None:
        """Advertise the topic of a source."""
        self._host, self._source = host, source.name
        self._outlet = Outlet(host, PointCloud2, f"{SENSED}/{source.name}", image_qos())
        self._told = UNSTAMPED

    def is_heard(self) -> bool:
        """Tell whether somebody listens."""
        return self._outlet.is_heard()

    def has_work(self) -> bool:
        """Tell whether somebody listens."""
        return self._outlet.is_due()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: points are there."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish the points of a message that is new."""
        image = snapshot.images.get(self._source)
        if image is None or image.stamp == self._told:
            return
        self._told = image.stamp
        self._outlet.publish(
            sensed_points_to_msg(
                image.p_WPs,
                image.radii,
                stamp_ns=image.stamp,
                frame_id=self._host.world_frame,
            )
        )

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: points are of their moment."""

    def close(self) -> None:
        """Stop being advertised."""
        self._outlet.close()

    def counters(self) -> Mapping[str, Any]:
        """Return the number of messages."""
        return {"messages": self._outlet.messages}
