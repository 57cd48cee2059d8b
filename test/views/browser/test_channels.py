"""Channels and who subscribes to them, without a network: what goes out, waits and is lost."""

from __future__ import annotations

import json
import struct

import pytest

from scene_graph_ros.views.browser import channels as module
from scene_graph_ros.views.browser.channels import Channels


@pytest.fixture
def calls():
    """How often channels wanted to be written to."""
    return []


@pytest.fixture
def channels(calls):
    """No channels yet, at the times 1, 2, 3 ... ns."""
    times = iter(range(1, 10**6))
    return Channels(
        "/node", "definition of {}".format, clock=times.__next__, wanted=lambda: calls.append(1)
    )


def texts(subscriber):
    """Return the texts that wait for a client."""
    found = []
    while isinstance(message := subscriber.take(), str):
        found.append(json.loads(message))
    assert message is None
    return found


def data(subscriber):
    """Return subscription, time and content of each message that waits."""
    found = []
    while (message := subscriber.take()) is not None:
        head, content = message
        assert head[0] == 1
        found.append((*struct.unpack("<IQ", head[1:]), content))
    return found


def test_a_client_is_told_of_channels_as_they_come_and_go(channels):
    """The server first, then what is offered, even if that is nothing."""
    client = channels.join(lambda: None)
    info, nothing = texts(client)
    assert (info["op"], info["name"], info["capabilities"]) == ("serverInfo", "/node", [])
    assert nothing == {"op": "advertise", "channels": []}
    channel = channels.channel("/t", "a_msgs/msg/B")
    (offer,) = texts(client)
    assert offer["channels"] == [
        {
            "id": channel.number,
            "topic": "/t",
            "encoding": "cdr",
            "schemaName": "a_msgs/msg/B",
            "schema": "definition of a_msgs/msg/B",
            "schemaEncoding": "ros2msg",
        }
    ]
    channel.close()
    again = channels.channel("/t", "a_msgs/msg/B")
    assert again.number != channel.number
    gone, offer = texts(client)
    assert gone == {"op": "unadvertise", "channelIds": [channel.number]}
    assert [each["id"] for each in offer["channels"]] == [again.number]


def test_only_who_subscribes_gets_messages(channels, calls):
    """With the number of the own subscription, until it unsubscribes or leaves."""
    channel = channels.channel("/t", "a_msgs/msg/B")
    one, two, three = (channels.join(lambda: None) for _ in range(3))
    for client in (one, two, three):
        texts(client)
    assert not channel.is_heard()
    channel.write(b"nobody")
    one.subscribe(7, channel.number)
    two.subscribe(9, channel.number)
    assert len(calls) == 2
    assert channel.is_heard()
    assert channel.take_key()
    assert not channel.take_key()
    assert not channel.take_missed()
    channel.write(b"x")
    assert data(one) == [(7, 1, b"x")]
    assert data(two) == [(9, 1, b"x")]
    assert data(three) == []
    one.unsubscribe(7)
    channel.write(b"y")
    assert data(one) == []
    assert data(two) == [(9, 2, b"y")]
    two.leave()
    assert not channel.is_heard()


def test_mistakes_are_told(channels):
    """A channel that is not there, twice the same, a subscription that is not there."""
    channel = channels.channel("/t", "a_msgs/msg/B")
    client = channels.join(lambda: None)
    texts(client)
    client.subscribe(1, channel.number)
    client.subscribe(2, channel.number)
    client.subscribe(1, channel.number)
    client.subscribe(3, 999)
    client.unsubscribe(4)
    errors = texts(client)
    assert {each["level"] for each in errors} == {2}
    words = ["subscription 2", "subscription 1", "channel 999", "subscription 4"]
    assert all(word in each["message"] for word, each in zip(words, errors, strict=True))


def test_what_waits_for_a_slow_client_is_bounded_and_made_good(channels, monkeypatch, calls):
    """The oldest go, of what has most; when a channel has caught up it is to say all anew."""
    monkeypatch.setattr(module, "_MOST_WAITING", 10 * (1000 + module._OVERHEAD))
    large = channels.channel("/large", "a_msgs/msg/B")
    small = channels.channel("/small", "a_msgs/msg/B")
    client = channels.join(lambda: None)
    texts(client)
    client.subscribe(1, large.number)
    client.subscribe(2, small.number)
    assert large.take_key()
    assert small.take_key()
    small.write(b"s")
    for k in range(100):
        large.write(bytes([k]) * 1000)
    assert client._waiting_bytes <= module._MOST_WAITING
    before = len(calls)
    found = data(client)
    # 10 of 1000 bytes would fit; a small one takes the room of one.
    assert [row[2][0] for row in found if row[0] == 1] == list(range(91, 100))
    assert [row[2] for row in found if row[0] == 2] == [b"s"]
    assert found[1][0] == 2 or found[0][0] == 2, "channels take turns"
    assert channels.dropped == 91
    assert client._waiting_bytes == 0
    assert len(calls) == before + 1
    assert large.take_missed()
    assert large.take_key()
    assert not large.take_missed()
    assert not small.take_missed()


def test_one_message_waits_whatever_its_size_and_age(channels, monkeypatch):
    """The newest of a channel; older ones that have waited for long are left out."""
    monkeypatch.setattr(module, "_MOST_WAITING", 10)
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    channel = channels.channel("/t", "a_msgs/msg/B")
    client = channels.join(lambda: None)
    texts(client)
    client.subscribe(1, channel.number)
    channel.write(b"a" * 100)
    now[0] += 10.0
    assert data(client) == [(1, 1, b"a" * 100)]
    monkeypatch.undo()
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    for content in (b"a", b"b", b"c"):
        channel.write(content)
        now[0] += 0.7
    # After 2.1 s only what came 0.7 s ago is left.
    assert [row[2] for row in data(client)] == [b"c"]
    assert channel.take_missed()


def test_simulated_time_is_told_now_and_then(channels, monkeypatch):
    """By itself, beside the messages that are stamped with it."""
    monkeypatch.setattr(channels, "is_simulated", lambda: True)
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    client = channels.join(lambda: None)
    assert json.loads(client.take())["capabilities"] == ["time"]
    client.take()
    assert struct.unpack("<BQ", *client.take()) == (2, 1)
    assert client.take() is None
    now[0] += module.TIME_PERIOD
    assert struct.unpack("<BQ", *client.take()) == (2, 2)
