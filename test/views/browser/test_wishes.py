"""What pages ask for."""

from __future__ import annotations

import pytest

from scene_graph_ros.geometry import Role
from scene_graph_ros.views.browser.motion_requests import (
    Cancel,
    Drag,
    Execute,
    Hold,
    LetGo,
    PlanWay,
)
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
    ("text", "request_"),
    [
        (
            '{"motion": "hold", "robot": "arm", "link": "hand", "group": ""}',
            Hold("arm", "hand", ""),
        ),
        (
            '{"number": 3, "motion": "drag", "position": [1, 2, 3], "rotation": [0, 0, 0, 2]}',
            Drag(3, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 2.0)),
        ),
        ('{"motion": "plan", "scaling": 0.25, "replaces": true}', PlanWay(0.25, replaces=True)),
        ('{"motion": "execute", "plan": 2}', Execute(2)),
        ('{"motion": "cancel"}', Cancel()),
        ('{"motion": "let_go"}', LetGo()),
    ],
)
def test_a_motion_is_named(text, request_):
    """With its own fields, in whatever order."""
    found = parse_wish(text)
    assert found == request_ and type(found) is type(request_)


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
        '{"motion": null}',
        '{"motion": {"hold": 1}}',
        '{"motion": "cancel", "plan": 1}',
        '{"motion": "hold", "robot": "arm", "link": 1, "group": ""}',
        '{"motion": "hold", "robot": "arm", "link": "hand"}',
        '{"motion": "drag", "number": 0.5, "position": [0, 0, 0], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": 1, "position": [0, 0, "0"], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": 1, "position": [0, 0, 1e999], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": 1, "position": [0, 0, 0, 0], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": 1, "position": {}, "rotation": [0, 0, 0, 1]}',
        '{"motion": "plan", "scaling": 1.5, "replaces": false}',
        '{"motion": "plan", "scaling": -0.5, "replaces": false}',
        '{"motion": "plan", "scaling": 1e-6, "replaces": false}',
        '{"motion": "plan", "scaling": NaN, "replaces": false}',
        '{"motion": "plan", "scaling": 1, "replaces": 0}',
        '{"motion": "execute", "plan": -1}',
        '{"motion": "execute", "plan": 1' + "0" * 400 + "}",
    ],
)
def test_anything_else_is_rubbish(text):
    """Each is refused with what it is."""
    with pytest.raises(WishError):
        parse_wish(text)
