"""Who may read, and what a page is."""

from __future__ import annotations

from http import HTTPStatus
from pathlib import Path
import re

import pytest

from scene_graph_ros.views import browser
from scene_graph_ros.views.browser.gate import Gate, SOCKET_PATH
from scene_graph_ros.views.loopback import is_loopback

PAGE = Path(browser.__file__).parent / "page"
HOST = "127.0.0.1:8780"


def status(gate, target=SOCKET_PATH, host=HOST, origin=None):
    """Return the status of an answer, None where a page may connect."""
    answer = gate.answer(target, host, origin)
    return None if answer is None else answer.status


@pytest.mark.parametrize(
    ("host", "is_ours"),
    [
        ("127.0.0.1:8780", True),
        ("localhost:9000", True),  # through a tunnel, whose port is another
        ("LOCALHOST", True),
        ("[::1]:8780", True),
        ("192.168.1.5:8780", True),
        ("robot.lan:8780", True),
        ("evil.example:8780", False),
        ("127.0.0.1.evil.example", False),
        ("localhost.evil.example:8780", False),
        ("evil.example@localhost.evil.example", False),
        ("robot", False),
        ("", False),
        ("[::1", False),
    ],
)
def test_a_host_is_an_address_or_a_name_of_ours(host, is_ours):
    """A name of somebody else's that leads here is none, for the page as for what it shows."""
    gate = Gate("robot.lan", "")
    refused = HTTPStatus.MISDIRECTED_REQUEST
    assert status(gate, host=host) == (None if is_ours else refused)
    assert status(gate, "/", host=host) == (HTTPStatus.OK if is_ours else refused)


@pytest.mark.parametrize(
    ("origin", "may"),
    [
        (None, True),  # no browser
        ("http://127.0.0.1:8780", True),
        ("https://127.0.0.1:8780", True),  # behind a proxy with TLS
        ("http://127.0.0.1:8781", False),  # another program's page on this machine
        ("http://localhost:8780", False),
        ("http://evil.example", False),
        ("http://127.0.0.1:8780.evil.example", False),
        ("null", False),
        ("file://", False),
        ("", False),
    ],
)
def test_only_our_page_may_connect(origin, may):
    """The origin of a page is the host that it asks, exactly."""
    gate = Gate("127.0.0.1", "")
    assert status(gate, origin=origin) == (None if may else HTTPStatus.FORBIDDEN)


def test_a_token_is_asked_for_where_there_is_one():
    """Of what connects only: the page itself says nothing of the scene."""
    gate = Gate("127.0.0.1", "päss&word")
    assert status(gate) == HTTPStatus.FORBIDDEN
    assert status(gate, f"{SOCKET_PATH}?token=pass") == HTTPStatus.FORBIDDEN
    assert status(gate, f"{SOCKET_PATH}?token=") == HTTPStatus.FORBIDDEN
    assert status(gate, f"{SOCKET_PATH}?token=p%C3%A4ss%26word") is None
    assert status(gate, "/") == HTTPStatus.OK
    assert status(Gate("127.0.0.1", ""), f"{SOCKET_PATH}?token=any") is None


def test_only_the_files_of_the_page_are_served():
    """Each with its type; nothing else, whatever the path tries."""
    gate = Gate("127.0.0.1", "")
    for file in PAGE.iterdir():
        answer = gate.answer(f"/{file.name}", HOST, None)
        assert answer.status == HTTPStatus.OK
        assert answer.body == file.read_bytes()
        assert answer.headers()["Content-Length"] == str(file.stat().st_size)
    assert gate.answer("/?token=1", HOST, None).type == "text/html; charset=utf-8"
    assert gate.answer("/main.js", HOST, None).type == "text/javascript; charset=utf-8"
    for target in (
        "/gate.py",
        "/../gate.py",
        "/%2e%2e/gate.py",
        "//etc/passwd",
        "/scene/",
        "*",
        "//[",
    ):
        assert status(gate, target) == HTTPStatus.NOT_FOUND


def test_the_page_needs_nothing_from_elsewhere():
    """No address of another place is in it, all it imports is beside it, and it is told so."""
    imported = set()
    for file in PAGE.iterdir():
        text = file.read_text()
        assert not re.search(r"https?://|//cdn|@import|url\(", text), file.name
        imported |= set(re.findall(r'from "\./([\w.]+)"', text))
        imported |= set(re.findall(r'(?:src|href)="([\w.]+)"', text))
        assert not re.search(r'from "(?!\./)', text), file.name
    assert imported | {"index.html"} == {file.name for file in PAGE.iterdir()}
    policy = Gate("127.0.0.1", "").answer("/", HOST, None).headers()["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy


def test_only_this_machines_own_addresses_are_loopback():
    """Where others reach it a token is asked for."""
    own = ("127.0.0.1", "127.3.2.1", "::1", "localhost")
    others = ("0.0.0.0", "::", "192.168.1.5", "", "robot", "localhost.example")
    assert [is_loopback(host) for host in own] == [True] * 4
    assert [is_loopback(host) for host in others] == [False] * 6
