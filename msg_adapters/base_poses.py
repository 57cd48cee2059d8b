"""Where a robot's base is: messages of several types to one pose with its stamp and parent."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import PoseStamped, TransformStamped

from msg_adapters.poses import pose_batch, PoseBatch, poses_from_transform_stamped
from msg_adapters.stamps import checked_stamp_from_msg

__all__ = ["base_poses_from_msg"]


def base_poses_from_msg(msg: Any) -> PoseBatch:
    """Return the pose in a PoseStamped, PoseWithCovarianceStamped, TransformStamped or Odometry.

    Its name is the ``child_frame_id``, empty where the type has none, its parent the header's
    ``frame_id``. Raises MessageError for a stamp that is no time.
    """
    if isinstance(msg, TransformStamped):
        return poses_from_transform_stamped(msg)
    name = getattr(msg, "child_frame_id", "")
    pose = msg.pose if isinstance(msg, PoseStamped) else msg.pose.pose
    p, q = pose.position, pose.orientation
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    return pose_batch(
        [name], [msg.header.frame_id], [stamp_ns], [(p.x, p.y, p.z, q.x, q.y, q.z, q.w)]
    )
