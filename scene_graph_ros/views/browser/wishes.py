"""Requests of a page: its choice of things to show, a joint's motion, or a tool's."""

from __future__ import annotations

import json
from typing import NamedTuple

from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.views.browser.motion_requests import motion_request, MotionRequest
from scene_graph_ros.views.browser.wish_error import number_of, WishError

__all__ = ["SHOWN_ROLES", "Move", "Wish", "WishError", "parse_wish"]

SHOWN_ROLES = (Role.ILLUSTRATION, Role.PROXIMITY, Role.PERCEPTION)
"""In the order in which one of them is chosen for a page that leaves it to us."""

_BY_NAME = {role.name.lower(): role for role in SHOWN_ROLES}


class Wish(NamedTuple):
    """A page's choice of things to show."""

    roles: tuple[Role, ...] | None = None
    """In the order of SHOWN_ROLES; None: the first of these that some geometry has."""
    contacts: bool = False
    camera: str = ""
    """Whose picture it shows; "": nobody's."""


class Move(NamedTuple):
    """A joint that is to be somewhere else."""

    robot: str
    joint: str
    position: float
    """In rad or m, finite."""


def parse_wish(text: str) -> Wish | Move | MotionRequest:
    """Return the request in a page's message.

    ``{"roles": ["illustration"] or null, "contacts": true, "camera": ""}`` or ``{"robot": "arm",
    "joint": "elbow", "position": 0.5}`` or as of `motion_request`. Raises WishError for anything
    else.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WishError(f"{quoted(text)} is no JSON") from error
    fields = content.keys() if isinstance(content, dict) else set()
    if "motion" in fields:
        return motion_request(content)
    if fields == set(Move._fields):
        return _move(*(content[field] for field in Move._fields))
    if fields == set(Wish._fields):
        return _wish(*(content[field] for field in Wish._fields))
    raise WishError(f"{quoted(text)} has not exactly the fields {', '.join(Wish._fields)}")


def _move(robot: object, joint: object, position: object) -> Move:
    if not isinstance(robot, str) or not isinstance(joint, str):
        raise WishError(f"robot and joint are no names: {quoted(robot)}, {quoted(joint)}")
    return Move(robot, joint, number_of(position, "position"))


def _wish(roles: object, contacts: object, camera: object) -> Wish:
    if not isinstance(contacts, bool):
        raise WishError(f"contacts is neither true nor false: {quoted(contacts)}")
    if not isinstance(camera, str):
        raise WishError(f"camera is no name: {quoted(camera)}")
    if roles is None:
        return Wish(None, contacts, camera)
    if not isinstance(roles, list) or not all(
        isinstance(name, str) and name in _BY_NAME for name in roles
    ):
        raise WishError(f"roles is no list of {', '.join(_BY_NAME)}: {quoted(roles)}")
    chosen = tuple(role for name, role in _BY_NAME.items() if name in roles)
    return Wish(chosen, contacts, camera)
