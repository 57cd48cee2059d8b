"""What pages ask for."""

from __future__ import annotations

import pytest

from scene_graph_ros.geometry import Role
from scene_graph_ros.views.browser.wishes import parse_wish, Wish, WishError


def test_a_wish_names_roles_contacts_and_a_camera():
    """In whatever order, the roles come in ours; null leaves them to us."""
    both = (Role.ILLUSTRATION, Role.PROXIMITY)
    wish = parse_wish(
        '{"roles": ["proximity", "illustration"], "contacts": true, "camera": "eye"}'
    )
    assert wish == Wish(both, contacts=True, camera="eye")
    assert parse_wish('{"camera": "", "contacts": false, "roles": null}') == Wish()
    assert parse_wish('{"camera": "", "contacts": false, "roles": []}') == Wish(())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        "[" * 1000,
        '{"roles": null}',
        '{"roles": null, "contacts": false}',
        '{"roles": null, "contacts": false, "camera": null}',
        '{"roles": null, "contacts": false, "more": 1, "camera": ""}',
        '{"roles": null, "contacts": 1, "camera": ""}',
        '{"roles": "illustration", "contacts": true, "camera": ""}',
        '{"roles": ["unassigned"], "contacts": true, "camera": ""}',
        '{"roles": [["illustration"]], "contacts": true, "camera": ""}',
        '{"roles": [null], "contacts": true, "camera": ""}',
    ],
)
def test_anything_else_is_rubbish(text):
    """Each is refused with what it is."""
    with pytest.raises(WishError):
        parse_wish(text)
