"""Quality of service of each kind of topic, and which of its policies parameters may override.

Overrides follow the ordinary scheme: ``qos_overrides.<topic>.<publisher|subscription>.<policy>``.
"""

from __future__ import annotations

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.qos_overriding_options import QoSOverridingOptions

__all__ = [
    "contact_qos",
    "diagnostics_qos",
    "feedback_qos",
    "image_qos",
    "latched_qos",
    "marker_qos",
    "overridable",
    "pose_qos",
    "service_qos",
]

_MARKERS_KEPT = 5
"""Messages of a marker topic, a sixth of a second at the default rate: on a busy machine, too, a
reader has got the oldest by then, so that nobody has to wait."""

_REQUESTS_KEPT = 5000
"""Requests of a service that the middleware keeps until they are taken, and answers until they
are acknowledged. What is beyond it throws away, and nobody learns of that. So it is more than may
wait, and time to take them while threads answer; what is not used costs nothing."""


def pose_qos(depth: int, *, is_reliable: bool = True, is_latched: bool = False) -> QoSProfile:
    """Return the profile of pose inputs.

    Reliable, so that an object that is placed once is not lost; a publisher that offers best
    effort only gets a reader to match, one that repeats its last messages gets a second one
    which asks for them.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE),
    )


def marker_qos() -> QoSProfile:
    """Return the profile of markers: the newest messages are kept for later subscribers.

    And for slow ones, as each motion is told once: see ``Receipts``.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=_MARKERS_KEPT,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def contact_qos() -> QoSProfile:
    """Return the profile of contacts: reliable; a subscriber may ask for less."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


def diagnostics_qos() -> QoSProfile:
    """Return the profile that diagnostic aggregators expect."""
    return QoSProfile(depth=10)


def feedback_qos() -> QoSProfile:
    """Return the profile that clients of actions expect of feedback."""
    return QoSProfile(depth=10)


def image_qos() -> QoSProfile:
    """Return the profile of images: reliable; a subscriber may ask for less.

    Two are kept, so that one may be on its way while the next is sent.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=2,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


def latched_qos() -> QoSProfile:
    """Return the profile of rare messages: the newest is kept for later subscribers."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def service_qos() -> QoSProfile:
    """Return the profile of services: as ROS has it, but deep enough for many requests at once.

    The same holds for their answers, in the node as in its clients.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=_REQUESTS_KEPT,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


def overridable() -> QoSOverridingOptions:
    """Let parameters override history, depth, reliability and durability of a topic."""
    return QoSOverridingOptions(
        policy_kinds=(
            QoSPolicyKind.HISTORY,
            QoSPolicyKind.DEPTH,
            QoSPolicyKind.RELIABILITY,
            QoSPolicyKind.DURABILITY,
        )
    )
