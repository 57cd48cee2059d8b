"""What a page asks for: roles, contacts, a camera. Anything else is rubbish."""

from __future__ import annotations

import json
from typing import NamedTuple

from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["SHOWN_ROLES", "Wish", "WishError", "parse_wish"]

SHOWN_ROLES = (Role.ILLUSTRATION, Role.PROXIMITY, Role.PERCEPTION)
"""In the order in which one of them is chosen for a page that leaves it to us."""

_BY_NAME = {role.name.lower(): role for role in SHOWN_ROLES}


class WishError(ValueError):
    """A message of a page that is none."""


class Wish(NamedTuple):
    """What a page shows."""

    roles: tuple[Role, ...] | None = None
    """In the order of SHOWN_ROLES; None: the first of these that some geometry has."""
    contacts: bool = False
    camera: str = ""
    """Whose picture it shows; "": nobody's."""


def parse_wish(text: str) -> Wish:
    """Return what ``{"roles": ["illustration"] or null, "contacts": true, "camera": ""}`` says.

    Raises WishError for whatever is not exactly that.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WishError(f"{quoted(text)} is no JSON") from error
    if not isinstance(content, dict) or content.keys() != set(Wish._fields):
        raise WishError(f"{quoted(text)} has not exactly the fields {', '.join(Wish._fields)}")
    roles, contacts, camera = (content[field] for field in Wish._fields)
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
