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

__all__ = ["contact_qos", "diagnostics_qos", "marker_qos", "overridable", "pose_qos"]


def pose_qos(depth: int, *, is_reliable: bool = True) -> QoSProfile:
    """Return the profile of pose inputs.

    Reliable, so that an object that is placed once is not lost; a publisher that offers best
    effort only gets a reader to match.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )


def marker_qos() -> QoSProfile:
    """Return the profile of markers: the newest message is kept for those who come later."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1,
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
