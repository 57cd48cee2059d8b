"""Requests of a page about a robot's tool: hold it, drag it, plan its way there, execute that."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.views.browser.wish_error import name_of, number_of, WishError

__all__ = [
    "LEAST_SCALING",
    "Cancel",
    "Drag",
    "Execute",
    "Hold",
    "LetGo",
    "MotionRequest",
    "PlanWay",
    "motion_request",
]


LEAST_SCALING = 0.01
"""Slower motions than a hundredth of the fastest are nothing to watch."""


class Hold(NamedTuple):
    """Have a link of a robot be the one that is dragged, from where it is."""

    robot: str
    link: str
    group: str
    """Of joints that may move; "": the smallest that carries the link."""


class Drag(NamedTuple):
    """Have the held link be elsewhere."""

    number: int
    """Told back with the answer."""
    position: tuple[float, ...]
    """Of the link's origin, x, y, z in the world's frame, m."""
    rotation: tuple[float, ...]
    """Quaternion x, y, z, w of any length but zero."""


class PlanWay(NamedTuple):
    """Plan a motion to where the robot was dragged."""

    scaling: float
    """Of velocities and accelerations how much is used, from LEAST_SCALING to 1."""
    replaces: bool
    """Whether it replaces the motion that is executed: it is executed when it was played."""


class Cancel(NamedTuple):
    """End the search for a motion."""


class Execute(NamedTuple):
    """Execute the motion that was found."""

    plan: int
    """Its number, so that it is the one that the page has shown."""


class LetGo(NamedTuple):
    """Hold nothing any more."""


MotionRequest = Hold | Drag | PlanWay | Cancel | Execute | LetGo


def motion_request(content: Mapping[str, object]) -> MotionRequest:
    """Return the request in a message whose field ``motion`` names it.

    ``{"motion": "drag", "number": 1, "position": [0.5, 0, 0.8], "rotation": [1, 0, 0, 0]}``, for
    instance. Raises WishError naming the field and its value.
    """
    kind = content["motion"]
    if not isinstance(kind, str) or kind not in _KINDS:
        raise WishError(f"motion is none of {', '.join(_KINDS)}: {quoted(kind)}")
    fields, make = _KINDS[kind]
    if content.keys() != {"motion", *fields}:
        named = ", ".join(("motion", *fields))
        raise WishError(f"{quoted(dict(content))} has not exactly the fields {named}")
    return make(*(content[field] for field in fields))


def _hold(robot: object, link: object, group: object) -> Hold:
    return Hold(name_of(robot, "robot"), name_of(link, "link"), name_of(group, "group"))


def _drag(number: object, position: object, rotation: object) -> Drag:
    return Drag(
        _count_of(number, "number"),
        _numbers_of(position, "position", 3),
        _numbers_of(rotation, "rotation", 4),
    )


def _plan(scaling: object, replaces: object) -> PlanWay:
    number = number_of(scaling, "scaling")
    if not LEAST_SCALING <= number <= 1.0:
        raise WishError(f"scaling must be from {LEAST_SCALING:g} to 1: {quoted(scaling)}")
    if not isinstance(replaces, bool):
        raise WishError(f"replaces is neither true nor false: {quoted(replaces)}")
    return PlanWay(number, replaces)


def _execute(plan: object) -> Execute:
    return Execute(_count_of(plan, "plan"))


def _count_of(value: object, field: str) -> int:
    number = number_of(value, field)
    if number < 0.0 or number != int(number):
        raise WishError(f"{field} is no whole number from 0 on: {quoted(value)}")
    return int(number)


def _numbers_of(values: object, field: str, count: int) -> tuple[float, ...]:
    if not isinstance(values, list) or len(values) != count:
        raise WishError(f"{field} is no list of {count} numbers: {quoted(values)}")
    return tuple(number_of(value, field) for value in values)


_KINDS: Mapping[str, tuple[tuple[str, ...], Callable[..., MotionRequest]]] = {
    "hold": (Hold._fields, _hold),
    "drag": (Drag._fields, _drag),
    "plan": (PlanWay._fields, _plan),
    "cancel": (Cancel._fields, Cancel),
    "execute": (Execute._fields, _execute),
    "let_go": (LetGo._fields, LetGo),
}
