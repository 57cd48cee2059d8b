"""What a page asks for: which roles it shows, and whether contacts. Anything else is rubbish."""

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


def parse_wish(text: str) -> Wish:
    """Return what ``{"roles": ["illustration"] or null, "contacts": true}`` says.

    Raises WishError for whatever is not exactly that.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WishError(f"{quoted(text)} is no JSON") from error
    if not isinstance(content, dict) or content.keys() != {"roles", "contacts"}:
        raise WishError(f"{quoted(text)} has not exactly the fields roles and contacts")
    roles, contacts = content["roles"], content["contacts"]
    if not isinstance(contacts, bool):
        raise WishError(f"contacts is neither true nor false: {quoted(contacts)}")
    if roles is None:
        return Wish(None, contacts)
    if not isinstance(roles, list) or not all(
        isinstance(name, str) and name in _BY_NAME for name in roles
    ):
        raise WishError(f"roles is no list of {', '.join(_BY_NAME)}: {quoted(roles)}")
    return Wish(tuple(role for name, role in _BY_NAME.items() if name in roles), contacts)
