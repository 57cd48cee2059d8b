"""Diagnostics of the parts of a source: a robot's joints, and links missing from TF."""

from __future__ import annotations

from typing import Any, NamedTuple

from scene_graph_ros.node.world.description_channel import DescriptionChannel
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.joint_channel import JointChannel
from scene_graph_ros.node.world.robot_motion import BASE, RobotMotion
from scene_graph_ros.node.world.tf_channel import TfReader

__all__ = ["Parts", "parts_of"]

_MOST_NAMED = 5


class Parts(NamedTuple):
    """Entries of a source's diagnostics, and in words why it is stale or wrong."""

    values: dict[str, Any]
    stale: str = ""
    warning: str = ""


def parts_of(channel: Any, now: int, moment: int, max_age: float) -> Parts:
    """Return the parts that a channel knows beside its counts.

    ``now`` is steady time, ``moment`` the node's, nanoseconds; ``max_age`` seconds, 0 for none.
    """
    if isinstance(channel, JointChannel):
        return _joints(channel, now, moment, max_age)
    if isinstance(channel, TfReader):
        how = "interpolated" if channel.tree.interpolates else "the newest of each"
        values = {"composed at one time": how}
        values.update({f"missing: {n}": why for n, why in tuple(channel.missing.items())})
        first = next(iter(tuple(channel.missing.values())), "")
        return Parts(values, warning=first)
    if isinstance(channel, DescriptionChannel) and channel.failure:
        return Parts({}, warning=f"the newest description is not used: {channel.failure}")
    return Parts(channel.newest)


def _joints(channel: JointChannel, now: int, moment: int, max_age: float) -> Parts:
    motion: RobotMotion = channel.motion
    rates, values = channel.rates.rates(now), dict[str, Any]()
    silent, never = [], []
    stamps, static = motion.stamps.tolist(), motion.is_static.tolist()
    for name, stamp, is_static in zip(motion.names, stamps, static, strict=True):
        age = (moment - stamp) * 1e-9
        rate = "" if name == BASE else f", {rates.get(name, 0.0):.1f} Hz"
        what = "base" if name == BASE else f"joint {name}"
        if stamp == UNSTAMPED:
            never.append(what)
            values[what] = "never"
        elif is_static:
            values[what] = "static"
        else:
            values[what] = f"{age:.3f} s{rate}"
            if 0.0 < max_age < age:
                silent.append(f"{what} for {age:.1f} s")
    first = channel.intake.statistics.first_arrival
    waited = 0.0 if first is None else (now - first) * 1e-9
    if never:
        values["never reported"] = _some(never)
    reasons = []
    if silent:
        reasons.append(f"not heard: {_some(silent)}")
    if never and 0.0 < max_age < waited:
        reasons.append(f"never heard: {_some(never)}")
    return Parts(values, stale="; ".join(reasons))


def _some(names: list[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
