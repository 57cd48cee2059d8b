"""What pages ask for."""

from __future__ import annotations

import pytest

from scene_graph_ros.geometry import Role
from scene_graph_ros.views.browser.wishes import Move, parse_wish, Wish, WishError


def test_a_wish_names_roles_contacts_and_a_camera():
    """In whatever order, the roles come in ours; null leaves them to us."""
    both = (Role.ILLUSTRATION, Role.PROXIMITY)
    wish = parse_wish(
        '{"roles": ["proximity", "illustration"], "contacts": true, "camera": "eye"}'
    )
    assert wish == Wish(both, contacts=True, camera="eye")
    assert parse_wish('{"camera": "", "contacts": false, "roles": null}') == Wish()
    assert parse_wish('{"camera": "", "contacts": false, "roles": []}') == Wish(())


def test_a_move_names_a_joint_and_where_it_is_to_be():
    """A finite number, whole ones included."""
    text = '{"joint": "elbow", "robot": "arm", "position": -0.5}'
    assert parse_wish(text) == Move("arm", "elbow", -0.5)
    assert parse_wish('{"joint": "elbow", "robot": "arm", "position": 2}').position == 2.0


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
        '{"robot": "arm", "joint": "elbow"}',
        '{"robot": "arm", "joint": "elbow", "position": null}',
        '{"robot": "arm", "joint": "elbow", "position": true}',
        '{"robot": "arm", "joint": "elbow", "position": NaN}',
        '{"robot": "arm", "joint": "elbow", "position": -Infinity}',
        '{"robot": "arm", "joint": "elbow", "position": 1' + "0" * 400 + "}",
        '{"robot": 1, "joint": "elbow", "position": 0}',
        '{"robot": "arm", "joint": ["elbow"], "position": 0}',
        '{"robot": "arm", "joint": "elbow", "position": 0, "contacts": true}',
    ],
)
def test_anything_else_is_rubbish(text):
    """Each is refused with what it is."""
    with pytest.raises(WishError):
        parse_wish(text)
