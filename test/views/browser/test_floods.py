"""Floods of connections, pings and fragments, and a process without file handles."""

from __future__ import annotations

import contextlib
import errno
import resource
import socket
import time
from urllib.parse import urlsplit

from browser_page import PageClient
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.protocol import State
from websockets.sync.client import connect

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.views.browser import listener as listener_module
from scene_graph_ros.views.browser.allowance import Allowance
from scene_graph_ros.views.browser.server import BrowserView


@pytest.fixture
def show(stage):
    """Show a ball, and return the view with what it says of file handles."""
    stage.add("ball", Sphere(0.5))
    views = []

    def start():
        told = []
        view = BrowserView(
            "127.0.0.1",
            0,
            rate=1000.0,
            wanted=lambda: view.offer(stage.moment()),
            no_handles=told.append,
        )
        view.start()
        views.append(view)
        return view, told

    yield start
    for view in views:
        view.end()


def place(view):
    """Return where a view listens."""
    parts = urlsplit(view.address)
    return parts.hostname, parts.port


FRAMES = {
    "ping": b"\x89\x80\0\0\0\0",
    "pong": b"\x8a\x80\0\0\0\0",
    "empty fragment": b"\x00\x80\0\0\0\0",
}
"""RFC 6455, 5.2: masked, and without content."""


@pytest.mark.parametrize("kind", FRAMES)
def test_a_client_that_floods_is_cut_off(show, kind):
    """After some hundred frames, whatever they are; they are not all taken apart."""
    view, _ = show()
    with connect(f"ws{view.address.removeprefix('http')}scene", proxy=None) as client:
        flood = FRAMES[kind] * 1_000_000
        if kind == "empty fragment":
            flood = b"\x01\x80\0\0\0\0" + flood
        client.socket.settimeout(60.0)
        with contextlib.suppress(OSError):
            client.socket.sendall(flood)
        with contextlib.suppress(ConnectionClosed):
            for _ in iter(lambda: client.recv(timeout=60.0), None):
                pass
        assert client.state is State.CLOSED
    page = PageClient(view.address)
    page.take_until(lambda: page.named("ball"))
    page.close()


def test_a_storm_of_connections_is_refused_and_pages_go_on(show, stage, monkeypatch):
    """Those above the rate of their address; a page that is there is told of each move."""
    monkeypatch.setattr(listener_module, "_PAUSE", 0.0)
    view, _ = show()
    page = PageClient(view.address)
    page.take_until(lambda: page.named("ball"))
    refused = view.counters()["connections refused, as they came too fast"]
    assert refused == 0
    for k in range(1000):
        with contextlib.suppress(OSError), socket.create_connection(place(view), timeout=0.1):
            pass
        if k % 100 == 0:
            stage.move("ball", (k + 1.0, 0.0, 0.0))
            view.offer(stage.moment())
            page.take_until(lambda k=k: page.position("ball") == [k + 1.0, 0, 0])
        if view.counters()["connections refused, as they came too fast"]:
            break
    else:
        raise AssertionError("all 1000 connections were accepted")
    page.close()


def test_an_allowance_comes_back_with_time(monkeypatch):
    """So many at once, then as many as come each second."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    allowance = Allowance(10.0, 5.0)
    assert [allowance.is_used_up() for _ in range(6)] == [False] * 5 + [True]
    now[0] += 0.2  # two more, of which one was owed
    assert [allowance.is_used_up() for _ in range(2)] == [False, True]
    now[0] += 100.0
    assert [allowance.is_used_up() for _ in range(6)] == [False] * 5 + [True]


def test_without_file_handles_one_error_is_told_a_second(show, capfd):
    """Sixty come where no handle is left: nobody prints, and those who are there go on."""
    view, told = show()
    page = PageClient(view.address)
    page.take_until(lambda: page.named("ball"))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    clients = [socket.socket() for _ in range(60)]
    try:
        # No new handle is below this limit; those that are open stay open.
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
        for client in clients:
            client.connect(place(view))
        end = time.monotonic() + 60.0
        while not told:
            assert time.monotonic() < end
        view._listener._again = float("inf")  # until the limit is as it was
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert told[0].errno == errno.EMFILE
    assert len(told) == 1
    view._listener._again = 0.0
    page.wish(["proximity"])
    page.take_until(lambda: page.scenes[-1]["roles"] == ["proximity"])
    page.close()
    for client in clients:
        client.close()
    assert capfd.readouterr().err == ""
