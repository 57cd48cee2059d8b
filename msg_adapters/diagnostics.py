"""Diagnostics, and the report on effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from msg_adapters.stamps import stamp_to_msg
from scene_graph_msgs.msg import EffectStatus

__all__ = [
    "diagnostic_array_to_msg",
    "diagnostic_status_to_msg",
    "effect_to_diagnostic",
    "effect_to_msg",
]

_LEVELS = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE,
)  # fmt: skip


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def diagnostic_status_to_msg(
    name: str, level: int | bytes, message: str, values: Mapping[str, Any], hardware_id: str = ""
) -> DiagnosticStatus:
    """Return one entry; ``level`` is 0 to 3 or a constant of ``DiagnosticStatus``.

    Values become text in their order, floats with six digits.
    """
    # The field is a `byte`, which rclpy takes as bytes of length one.
    level_byte = level if isinstance(level, bytes) else bytes([level])
    if level_byte not in _LEVELS:
        raise ValueError(f"level of {name!r} must be 0 to 3, not {level!r}")
    return DiagnosticStatus(
        level=level_byte,
        name=name,
        message=message,
        hardware_id=hardware_id,
        values=[KeyValue(key=str(key), value=_text(value)) for key, value in values.items()],
    )


def diagnostic_array_to_msg(
    statuses: Iterable[DiagnosticStatus], *, stamp_ns: int
) -> DiagnosticArray:
    """Return the message for ``/diagnostics``."""
    return DiagnosticArray(header=Header(stamp=stamp_to_msg(stamp_ns)), status=list(statuses))


def effect_to_msg(report: Any) -> EffectStatus:
    """Return the status of one effect from the node's ``EffectReport``."""
    return EffectStatus(
        name=report.name,
        is_on=bool(report.is_on),
        reason=report.reason,
        topics=list(report.topics),
        count=int(report.count),
        mean_seconds=float(report.mean_seconds),
        max_seconds=float(report.max_seconds),
    )


def effect_to_diagnostic(effect: EffectStatus, prefix: str) -> DiagnosticStatus:
    """Return the diagnostics entry ``<prefix>: <effect>`` for one effect."""
    values = {
        "on": effect.is_on,
        "topics": " ".join(effect.topics),
        "updates": effect.count,
        "mean time per update (s)": effect.mean_seconds,
        "max time per update (s)": effect.max_seconds,
    }
    return diagnostic_status_to_msg(
        f"{prefix}: {effect.name}", DiagnosticStatus.OK, effect.reason, values
    )
