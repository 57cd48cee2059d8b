"""What pages ask for."""

from __future__ import annotations

import pytest

from scene_graph_ros.geometry import Role
from scene_graph_ros.views.browser.wishes import parse_wish, Wish, WishError


def test_a_wish_names_roles_and_contacts():
    """In whatever order, the roles come in ours; null leaves them to us."""
    both = (Role.ILLUSTRATION, Role.PROXIMITY)
    wish = parse_wish('{"roles": ["proximity", "illustration"], "contacts": true}')
    assert wish == Wish(both, contacts=True)
    assert parse_wish('{"contacts": false, "roles": null}') == Wish(None, contacts=False)
    assert parse_wish('{"contacts": false, "roles": []}') == Wish((), contacts=False)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        "[" * 1000,
        '{"roles": null}',
        '{"roles": null, "contacts": false, "more": 1}',
        '{"roles": null, "contacts": 1}',
        '{"roles": "illustration", "contacts": true}',
        '{"roles": ["unassigned"], "contacts": true}',
        '{"roles": [["illustration"]], "contacts": true}',
        '{"roles": [null], "contacts": true}',
    ],
)
def test_anything_else_is_rubbish(text):
    """Each is refused with what it is."""
    with pytest.raises(WishError):
        parse_wish(text)
