"""Diagnostics and effects."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
import numpy as np
import pytest

from msg_adapters import diagnostics
from msg_adapters.stamps import stamp_to_msg
from scene_graph_msgs.msg import EffectStatus


def test_an_entry_keeps_its_values_in_order(over_the_wire: Callable[[Any], Any]) -> None:
    """Text as it is, floats with six digits, whatever else as Python prints it."""
    values = {"rate (Hz)": 99.98765432, "source": "arm", "drops": 3}
    status = diagnostics.diagnostic_status_to_msg("node: arm", 1, "late", values, "robot")
    msg = over_the_wire(diagnostics.diagnostic_array_to_msg([status], stamp_ns=2_000_000_003))
    assert msg.header.stamp == stamp_to_msg(2_000_000_003)
    assert msg.status == [
        DiagnosticStatus(
            level=DiagnosticStatus.WARN,
            name="node: arm",
            message="late",
            hardware_id="robot",
            values=[
                KeyValue(key="rate (Hz)", value="99.9877"),
                KeyValue(key="source", value="arm"),
                KeyValue(key="drops", value="3"),
            ],
        )
    ]


@pytest.mark.parametrize(
    ("level", "expected"),
    [(0, DiagnosticStatus.OK), (2, DiagnosticStatus.ERROR), (DiagnosticStatus.STALE,) * 2],
)
def test_levels_are_numbers_or_constants(level: int | bytes, expected: bytes) -> None:
    """Both ways of writing a level give the constant."""
    assert diagnostics.diagnostic_status_to_msg("n", level, "", {}).level == expected


@pytest.mark.parametrize("level", [4, b"\x07", b""])
def test_another_level_is_refused(level: int | bytes) -> None:
    """There are four."""
    with pytest.raises(ValueError, match="level of 'n'"):
        diagnostics.diagnostic_status_to_msg("n", level, "", {})


def test_an_effect_is_told_as_message_and_as_diagnostics(
    over_the_wire: Callable[[Any], Any],
) -> None:
    """All it says is in both, also when the times are numbers of numpy."""
    effect = over_the_wire(
        diagnostics.effect_to_msg(
            SimpleNamespace(
                name="point_contact",
                is_on=np.True_,
                reason="12 geometries have the proximity role",
                topics=("/s/contacts", "/s/contact_markers"),
                count=np.int64(7),
                mean_seconds=np.float64(0.00125),
                max_seconds=np.float64(0.0025),
            )
        )
    )
    assert effect == EffectStatus(
        name="point_contact",
        is_on=True,
        reason="12 geometries have the proximity role",
        topics=["/s/contacts", "/s/contact_markers"],
        count=7,
        mean_seconds=0.00125,
        max_seconds=0.0025,
    )
    status = diagnostics.effect_to_diagnostic(effect, "scene_graph")
    assert (status.name, status.message) == ("scene_graph: point_contact", effect.reason)
    assert [value.value for value in status.values] == [
        "True", "/s/contacts /s/contact_markers", "7", "0.00125", "0.0025",
    ]  # fmt: skip
