"""Foxglove's protocol over real sockets: who may connect, what is offered, what is cut off."""

from __future__ import annotations

import json
from pathlib import Path
import resource
import time
from urllib.parse import urlsplit

from foxglove_client import FoxgloveClient
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from scene_graph_ros.geometry.files import read_marked
from scene_graph_ros.views.browser import channels as channels_module
from scene_graph_ros.views.browser import connections
from scene_graph_ros.views.browser.assets import Asset, AssetError, FRAGMENT
from scene_graph_ros.views.browser.channels import Channels
from scene_graph_ros.views.browser.foxglove import parse_request, RequestError
from scene_graph_ros.views.browser.server import BrowserView, MAX_PAGES


class Offering:
    """A view that offers channels."""

    def __init__(self, assets=None, **options):
        self.channels = Channels("/node", "definition of {}".format, assets=assets)
        self.refused, self.failures = [], []
        self.view = BrowserView(
            "127.0.0.1",
            0,
            rate=10.0,
            channels=self.channels,
            failed=self.failures.append,
            refused_origin=self.refused.append,
            **options,
        )
        self.view.start()
        self.address = self.view.address

    def client(self, **options):
        """Connect."""
        return FoxgloveClient(self.address, **options)


@pytest.fixture
def offer():
    """Start views, which are ended."""
    views = []

    def start(**options):
        views.append(Offering(**options))
        return views[-1]

    yield start
    for each in views:
        each.view.end()
        assert not each.failures


def until(condition, what):
    """Wait for something that no message tells."""
    end = time.monotonic() + 60.0
    while not (result := condition()):
        assert time.monotonic() < end, what
        time.sleep(0.005)
    return result


@pytest.mark.parametrize("name", ["foxglove.websocket.v1", "foxglove.sdk.v1"])
def test_a_client_gets_what_it_subscribes_to(offer, name):
    """By both names of the protocol, on the port of the page; in order, and nothing else."""
    shown = offer()
    channel = shown.channels.channel("/t", "a_msgs/msg/B")
    shown.channels.channel("/u", "a_msgs/msg/B").write(b"nobody's")
    client = shown.client(name=name)
    assert client.socket.subprotocol == name
    client.subscribe("/t", 5)
    until(channel.is_heard, "the subscription")
    for k in range(100):
        channel.write(b"%d" % k)
    client.take_until(lambda: len(client.messages[5]) == 100)
    assert [row[1] for row in client.messages[5]] == [b"%d" % k for k in range(100)]
    assert abs(client.messages[5][-1][0] - time.time_ns()) < 60e9
    client.say("unsubscribe", subscriptionIds=[5])
    until(lambda: not channel.is_heard(), "the end of the subscription")
    assert shown.view.counters()["Foxglove clients"] == 1
    assert not shown.view.has_pages()
    client.close()
    until(lambda: not shown.channels.subscribers, "the end of the client")


def test_what_is_not_offered_is_told_and_the_client_stays(offer):
    """Clients of other servers may publish, set parameters and call services: here not."""
    shown = offer()
    client = shown.client()
    for operation in ("advertise", "setParameters", "getParameters", "subscribeConnectionGraph"):
        client.say(operation, channels=[], parameters=[], uri="file:///etc/passwd", requestId=1)
    client.take_until(lambda: len(client.errors) == 4)
    assert client.info["capabilities"] == []
    assert all("does not offer" in error for error in client.errors)
    client.close()


@pytest.mark.parametrize(
    "rubbish",
    [
        "hello",
        "[]",
        '{"op": 5}',
        '{"op": "explode"}',
        '{"op": "subscribe"}',
        '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": true, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1.5}]}',
        '{"op": "subscribe", "subscriptions": [7]}',
        '{"op": "unsubscribe", "subscriptionIds": [4294967296]}',
        "[" * 20_000,
        b"\x01\x00\x00\x00\x00published",
        [json.dumps({"op": "unsubscribe", "subscriptionIds": []})] * 2000,
    ],
    ids=lambda rubbish: str(rubbish)[:40],
)
def test_a_client_that_sends_rubbish_is_cut_off(offer, rubbish):
    """With the reason; nobody else is."""
    shown = offer()
    channel = shown.channels.channel("/t", "a_msgs/msg/B")
    other, client = shown.client(), shown.client()
    try:
        for message in rubbish if isinstance(rubbish, list) else [rubbish]:
            client.socket.send(message)
    except ConnectionClosed:  # before all of it was sent
        pass
    assert client.wait_closed()[0] == 1008
    until(lambda: shown.view.counters()["clients cut off"] == 1, "the count")
    other.subscribe("/t", 1)
    until(channel.is_heard, "the subscription")
    channel.write(b"x")
    other.take_until(lambda: other.messages[1])
    other.close()


def test_a_message_that_is_too_long_is_none():
    """What one can hold fits; the parser takes no numbers of other kinds."""
    rows = [{"id": k, "channelId": k} for k in range(500)]
    text = json.dumps({"op": "subscribe", "subscriptions": rows})
    assert len(text) < 1 << 15
    assert len(parse_request(text).subscribe) == 500
    with pytest.raises(RequestError, match="channelId"):
        parse_request('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": NaN}]}')


def test_pages_from_elsewhere_read_only_where_that_is_configured(offer):
    """The origin counts, exactly; the token counts for all; who was refused is told."""
    for origins, allowed in (((), False), (("https://app.foxglove.dev",), True)):
        shown = offer(origins=origins)
        if allowed:
            shown.client(origin="https://app.foxglove.dev").close()
        else:
            with pytest.raises(InvalidStatus):
                shown.client(origin="https://app.foxglove.dev")
        for other in ("http://app.foxglove.dev", "https://app.foxglove.dev.evil.example", "null"):
            with pytest.raises(InvalidStatus):
                shown.client(origin=other)
        assert len(shown.refused) == 4 - allowed
    shown = offer(token="secret")
    with pytest.raises(InvalidStatus):
        shown.client()
    shown.client(query="?token=secret").close()
    # The address itself is a page for whoever asks for no such protocol.
    with pytest.raises(InvalidStatus):
        FoxgloveClient(shown.address, name="other", query="?token=secret")


def test_a_stuck_client_costs_others_nothing_and_is_cut_off(offer, monkeypatch):
    """It takes nothing of 100 MB; what waits for it stays below the bound."""
    monkeypatch.setattr(connections, "_STUCK_SECONDS", 1.0)
    shown = offer()
    channel = shown.channels.channel("/t", "a_msgs/msg/B")
    other = shown.client()
    other.subscribe("/t", 1)
    # It reads no more after a few hundred kB: nobody takes what has come.
    stuck = shown.client(max_queue=1)
    stuck.subscribe("/t", 2)
    until(lambda: len(channel.subscribers) == 2, "the subscriptions")
    waiting = next(each for each in channel.subscribers if channel.subscribers[each] == 2)
    for k in range(100):
        channel.write(b"%4d" % k + bytes(10**6))
        other.take_until(lambda k=k: len(other.messages[1]) > k)
        assert waiting._waiting_bytes <= channels_module._MOST_WAITING
    assert [int(row[1][:4]) for row in other.messages[1]] == list(range(100))
    until(lambda: len(channel.subscribers) == 1, "the end of the stuck client")
    assert shown.view.counters()["clients cut off"] == 1
    assert shown.channels.dropped > 50
    other.close()
    assert urlsplit(shown.address).port


def test_files_are_sent_by_their_addresses(offer, tmp_path):
    """Each request has its answer: what the file holds, or why it is not sent."""
    path = tmp_path / "b.stl"
    path.write_bytes(bytes(range(256)) * 5000)

    def find(address):
        if address == "package://a/b.stl":
            return Asset(address, read_marked(path, 10**7)[1])
        raise AssetError(f"none is at {address}")

    shown = offer(assets=find)
    client = shown.client()
    assert client.fetch(7, "package://a/b.stl") == bytes(range(256)) * 5000
    assert client.info["capabilities"] == ["assets"]
    assert client.fetch(2**32 - 1, "file:///etc/passwd") == "none is at file:///etc/passwd"
    # Others go on beside it, in one connection.
    channel = shown.channels.channel("/t", "a_msgs/msg/B")
    client.subscribe("/t", 5)
    until(channel.is_heard, "a subscription")
    for number in range(10, 30):
        client.say("fetchAsset", uri="package://a/b.stl", requestId=number)
    channel.write(b"beside")
    client.take_until(lambda: client.messages[5] and len(client.assets) == 22)
    client.say("fetchAsset", uri=7, requestId=1)
    assert client.wait_closed()[1].startswith("uri is no text: 7")


def resident():
    """Return the bytes of memory that this process has."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def test_files_for_clients_that_read_nothing_take_no_memory(offer, tmp_path):
    """Sixteen ask sixty times each for 60 MiB: a fragment of it is kept for each, and no more."""
    path = tmp_path / "large.stl"
    with path.open("wb") as file:
        file.truncate(60 * 2**20)
    mark = read_marked(path, 2**26)[1]
    shown = offer(assets=lambda address: Asset(address, mark))
    channel = shown.channels.channel("/t", "a_msgs/msg/B")
    before, clients = resident(), []
    # One place is left for somebody who reads.
    for _ in range(MAX_PAGES - 1):
        clients.append(shown.client(max_queue=1))
        for number in range(60):
            clients[-1].say("fetchAsset", uri="package://a/large.stl", requestId=number)
    waits = (MAX_PAGES - 1) * FRAGMENT
    until(lambda: shown.channels.waiting.bytes == waits, "an answer on its way to each")
    reader = shown.client()
    reader.subscribe("/t", 5)
    until(channel.is_heard, "the subscription")
    for k in range(100):
        channel.write(b"%d" % k)
        reader.take_until(lambda k=k: len(reader.messages[5]) > k)
    assert resident() - before < 60 * 2**20
    reader.close()


def test_a_view_without_files_says_so(offer):
    """By name, to who asks all the same."""
    client = offer().client()
    client.say("fetchAsset", uri="package://a/b.stl", requestId=1)
    client.take_until(lambda: client.info)
    client.info["capabilities"] = ["assets"]  # as if it had been offered
    assert "does not offer fetchAsset" in client.take_until(lambda: client.assets.get(1))
