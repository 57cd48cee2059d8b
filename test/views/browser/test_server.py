"""The view over real sockets: what pages see, and who is kept out or cut off."""

from __future__ import annotations

import contextlib
from http.client import HTTPConnection
import json
import socket
import threading
import time
from urllib.parse import urlsplit

from browser_page import DEADLINE, PageClient
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from scene_graph_ros.geometry import Mesh, Sphere
from scene_graph_ros.views.browser import connections
from scene_graph_ros.views.browser.server import BrowserView, MAX_PAGES


class Shown:
    """A view of a stage, which is offered whenever the view wants it or something is done."""

    def __init__(self, stage, **options) -> None:
        self.stage = stage
        self.wanted = 0
        self.failures: list[Exception] = []
        self._lock = threading.Lock()
        options = {"rate": 1000.0, **options}
        self.view = BrowserView(
            "127.0.0.1", 0, wanted=self._want, failed=self.failures.append, **options
        )
        self.view.start()

    @property
    def address(self):
        """Where it is."""
        return self.view.address

    def _want(self):
        self.wanted += 1
        self.offer()

    def offer(self, change=None):
        """Show how the stage is, after a change of it."""
        with self._lock:
            if change is not None:
                change()
            self.view.offer(self.stage.moment())

    def page(self, **options):
        """Open a page."""
        return PageClient(self.address, **options)

    def status(self, target, **headers):
        """Return the status that a request gets."""
        connection = HTTPConnection(urlsplit(self.address).netloc, timeout=DEADLINE)
        connection.request("GET", target, headers=headers)
        response = connection.getresponse()
        response.read()
        connection.close()
        return response.status


@pytest.fixture
def show(stage):
    """Show the stage, with a ball on it."""
    stage.add("ball", Sphere(0.5))
    views = []

    def start(**options):
        views.append(Shown(stage, **options))
        return views[-1]

    yield start
    for shown in views:
        shown.view.end()
        assert not shown.failures


def until(condition, what):
    """Wait for something that no message tells."""
    end = time.monotonic() + DEADLINE
    while not (result := condition()):
        assert time.monotonic() < end, what
        time.sleep(0.005)
    return result


def test_a_page_sees_the_scene_and_what_happens_to_it(show, stage):
    """What is there, a frame that moves, a geometry that comes and one that goes."""
    shown = show()
    page = shown.page()
    page.take_until(lambda: page.position("ball") == [0, 0, 0])
    shown.offer(lambda: stage.move("ball", (1.0, 2.0, 3.0)))
    page.take_until(lambda: page.position("ball") == [1, 2, 3])
    shown.offer(lambda: stage.add("other", Sphere(0.25), (4.0, 0, 0)))
    page.take_until(lambda: page.position("other") == [4, 0, 0])
    shown.offer(lambda: stage.remove("ball"))
    page.take_until(lambda: page.named("ball") is None)
    page.close()


def test_a_late_page_sees_all_and_the_first_one_nothing_again(show, stage):
    """Each page is told by itself."""
    shown = show()
    first = shown.page()
    first.take_until(lambda: first.named("ball"))
    shown.offer(lambda: stage.move("ball", (1.0, 0, 0)))
    first.take_until(lambda: first.position("ball") == [1, 0, 0])
    late = shown.page()
    late.take_until(lambda: late.position("ball") == [1, 0, 0])
    assert [len(page.scenes) for page in (first, late)] == [1, 1]
    first.close()
    shown.offer(lambda: stage.move("ball", (2.0, 0, 0)))
    late.take_until(lambda: late.position("ball") == [2, 0, 0])
    late.close()


def test_without_pages_nothing_is_made_or_kept(show, stage):
    """Neither before one comes nor after it has left."""
    shown = show()
    for _ in range(3):
        shown.offer()
    assert not shown.view.has_pages()
    page = shown.page()
    page.take_until(lambda: page.named("ball"))
    assert shown.wanted == 1
    page.close()
    until(lambda: not shown.view.has_pages(), "the end of the page")
    made = shown.view.count()
    for _ in range(3):
        shown.offer()
    assert shown.view.count() == made
    assert shown.view._pump._moment is None


def test_a_page_is_told_of_the_newest_moment_when_it_is_ready(show, stage):
    """Of a thousand moments at once it sees few, and the last one."""
    shown = show(rate=20.0)
    page = shown.page()
    page.take_until(lambda: page.named("ball"))
    for k in range(1000):
        shown.offer(lambda k=k: stage.move("ball", (k, 0.0, 0.0)))
    page.take_until(lambda: page.position("ball") == [999, 0, 0])
    assert page.messages < 500
    page.close()


def test_what_is_costly_is_asked_for_when_it_is_due(show):
    """While no page is open, and before the time of the next message, nothing is."""
    shown = show(rate=0.1)
    assert not shown.view.is_due()
    page = shown.page()
    page.wish(contacts=True)
    page.take_until(lambda: page.contacts is not None or page.named("ball"))
    assert not shown.view.is_due()
    until(shown.view.wants_contacts, "the wish")
    page.close()
    until(lambda: not shown.view.wants_contacts(), "the end of the page")


def stuck_page(shown):
    """Return a connection that asks for the scene and reads nothing, with a small buffer."""
    host, port = urlsplit(shown.address).netloc.split(":")
    stuck = socket.socket()
    stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    stuck.connect((host, int(port)))
    key = "dGhlIHNhbXBsZSBub25jZQ=="
    stuck.sendall(
        f"GET /scene HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\n"
        f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
        "Sec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return stuck


def test_a_stuck_page_costs_others_nothing_and_is_cut_off(show, stage, monkeypatch):
    """It takes nothing of 20 MB; meanwhile another page sees each of a hundred moves."""
    monkeypatch.setattr(connections, "_STUCK_SECONDS", 1.0)
    vertices = [(k * 1e-6, k % 7, k % 5) for k in range(300_000)]
    faces = [(k, k + 1, k + 2) for k in range(299_998)]
    stage.add("large", Mesh(vertices=vertices, faces=faces), roles=("illustration",))
    shown = show()
    stuck = stuck_page(shown)
    until(shown.view.has_pages, "the stuck page")
    page = shown.page()
    page.wish(["proximity"])
    page.take_until(lambda: page.scenes and page.scenes[-1]["roles"] == ["proximity"])
    for k in range(1, 101):
        shown.offer(lambda k=k: stage.move("ball", (k, 0.0, 0.0)))
        page.take_until(lambda k=k: page.position("ball") == [k, 0, 0])
    until(lambda: shown.view.counters()["pages"] == 1, "the end of the stuck page")
    assert shown.view.counters()["clients cut off"] == 1
    shown.offer(lambda: stage.move("ball", (-1.0, 0.0, 0.0)))
    page.take_until(lambda: page.position("ball") == [-1, 0, 0])
    stuck.close()
    page.close()


@pytest.mark.parametrize(
    ("rubbish", "code"),
    [
        ("hello", 1008),
        ('{"roles": null, "contacts": "yes"}', 1008),
        (b"\x00\x01\x02", 1008),
        ("é" * 400, 1008),  # quoted, it is longer than a reason may be
        ("x" * 5000, 1009),  # too long, RFC 6455
        ([json.dumps({"roles": None, "contacts": False})] * 500, 1008),
    ],
    ids=["no JSON", "no wish", "bytes", "long reason", "too long", "too many"],
)
def test_a_page_that_sends_rubbish_is_cut_off(show, stage, rubbish, code):
    """With the reason, and nobody else is."""
    shown = show()
    other = shown.page()
    page = shown.page()
    with contextlib.suppress(ConnectionClosed):  # before all of it was sent
        for message in rubbish if isinstance(rubbish, list) else [rubbish]:
            page.socket.send(message)
    assert page.wait_closed()[0] == code
    until(lambda: shown.view.counters()["clients cut off"] == 1, "the count")
    shown.offer(lambda: stage.move("ball", (1.0, 0, 0)))
    other.take_until(lambda: other.position("ball") == [1, 0, 0])
    other.close()


def test_bytes_that_are_no_websocket_end_their_connection_only(show, stage):
    """A broken frame, a broken request and half a request."""
    shown = show()
    page = shown.page()
    host, port = urlsplit(shown.address).netloc.split(":")
    broken = stuck_page(shown)
    until(lambda: shown.view.counters()["pages"] == 2, "the page")
    broken.sendall(b"\xff" * 100)  # reserved bits are set
    until(lambda: shown.view.counters()["pages"] == 1, "the end of the page")
    for rubbish in (b"\x16\x03\x01\x02\x00\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 1000):
        with socket.create_connection((host, int(port))) as other:
            other.settimeout(DEADLINE)
            other.sendall(rubbish)
            assert b"200" not in other.recv(100)
    shown.offer(lambda: stage.move("ball", (1.0, 0, 0)))
    page.take_until(lambda: page.position("ball") == [1, 0, 0])
    page.close()
    broken.close()


def test_hosts_and_pages_from_elsewhere_are_refused(show):
    """By the page's request as by the socket's; nothing of the scene goes out."""
    shown = show(token="secret")
    assert shown.status("/") == 200
    assert shown.status("/main.js") == 200
    assert shown.status("/nothing") == 404
    assert shown.status("/", Host="evil.example:80") == 421
    query = "?token=secret"
    for options, status in (
        ({"query": ""}, 403),
        ({"query": "?token=guess"}, 403),
        ({"query": query, "origin": "http://evil.example"}, 403),
    ):
        with pytest.raises(InvalidStatus) as refused:
            shown.page(**options)
        assert refused.value.response.status_code == status
    assert shown.view.counters()["requests refused"] == 5
    assert shown.view.count() == 0
    assert shown.view.link == f"{shown.address}{query}"
    page = shown.page(query=query, origin=shown.address.rstrip("/"))
    page.take_until(lambda: page.named("ball"))
    page.close()


def test_there_are_not_more_pages_than_may_be(show):
    """One more is told so; when one has left there is room."""
    shown = show()
    pages = [shown.page() for _ in range(MAX_PAGES)]
    with pytest.raises(InvalidStatus) as refused:
        shown.page()
    assert refused.value.response.status_code == 503
    pages.pop().close()
    until(lambda: shown.view.counters()["pages"] == MAX_PAGES - 1, "room")
    pages.append(shown.page())
    pages[-1].take_until(lambda: pages[-1].named("ball"))
    for page in pages:
        page.close()


def test_what_cannot_be_made_is_told_and_tried_again_with_another_scene(stage, show, monkeypatch):
    """Once for each version of the scene, however many moments there are."""
    from scene_graph_ros.views.browser import cursor

    shown = show()
    page = shown.page()
    page.take_until(lambda: page.named("ball"))
    original = cursor.time_block

    def fail(*arguments):
        raise ValueError("on purpose")

    monkeypatch.setattr(cursor, "time_block", fail)
    for _ in range(3):
        shown.offer()
        until(lambda: shown.failures, "the failure")
    assert [str(error) for error in shown.failures] == ["on purpose"]
    monkeypatch.setattr(cursor, "time_block", original)
    shown.offer(lambda: stage.add("other", Sphere(0.25)))
    page.take_until(lambda: page.named("other"))
    assert page.scenes[-1]["begins"]
    shown.failures.clear()
    page.close()


def test_it_ends_with_its_threads_and_its_port(show):
    """While pages are open, and twice; the port is free at once for another view."""
    before = threading.active_count()
    shown = show()
    page = shown.page()
    page.take_until(lambda: page.named("ball"))
    number = urlsplit(shown.address).port
    shown.view.end()
    shown.view.end()
    assert page.wait_closed()
    page.close()
    until(lambda: threading.active_count() <= before, "the end of all threads")
    with BrowserContext(number) as view:
        assert view.address == shown.address


class BrowserContext:
    """A view on a port, that is ended."""

    def __init__(self, port):
        self.view = BrowserView("127.0.0.1", port, rate=10.0)

    def __enter__(self):
        self.view.start()
        return self.view

    def __exit__(self, *error):
        self.view.end()


def test_a_port_that_is_taken_is_an_error_at_once():
    """For whoever makes the view; one that never started can be ended."""
    first = BrowserView("127.0.0.1", 0, rate=10.0)
    with pytest.raises(OSError, match="in use"):
        BrowserView("127.0.0.1", urlsplit(first.address).port, rate=10.0)
    first.end()
