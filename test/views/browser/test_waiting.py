"""What waits for slow clients is bounded for all of them together."""

from __future__ import annotations

from scene_graph_ros.views.browser.channels import Channels
from scene_graph_ros.views.browser.waiting import Load, Waiting


def test_a_load_counts_once_however_many_clients_it_waits_for():
    """And until the last of them has it."""
    waiting, load = Waiting(100), Load(60)
    for _ in range(3):
        waiting.hold(load)
    assert waiting.bytes == 60
    for left in (60, 60, 0):
        waiting.release(load)
        assert waiting.bytes == left


def test_who_has_been_sent_something_longest_is_cut_off():
    """While half of what may wait is on its way; a client alone is sent whatever it is."""
    waiting, cut = Waiting(200), []

    def begin(name, size):
        waiting.begin(name, Load(size), lambda: cut.append(name))

    begin("alone", 1000)
    assert (cut, waiting.is_over()) == ([], True)
    waiting.end("alone")
    for name in ("first", "second", "third"):
        begin(name, 50)
    assert (cut, waiting.bytes) == (["first"], 100)
    waiting.end("first")
    waiting.end("second")
    begin("fourth", 90)
    assert (cut, waiting.bytes) == (["first", "third"], 90)
    waiting.end("fourth")
    assert waiting.bytes == 0


def test_messages_that_wait_for_all_clients_are_bounded():
    """Each client stays below its own bound, and all together are above theirs."""
    calls = []
    channels = Channels("/node", str, wanted=lambda: calls.append(1))
    channels.waiting = Waiting(10_000)
    one, two = (channels.channel(topic, "a_msgs/msg/B") for topic in ("/one", "/two"))
    cut, clients = [], []
    for k in range(16):
        client = channels.join(lambda: None, lambda k=k: cut.append(k))
        while client.take() is not None:
            pass
        for number, channel in enumerate((one, two)):
            client.subscribe(number, channel.number)
        clients.append(client)
    for channel in (one, two):
        channel.take_key()
        channel.write(bytes(800))
    # All wait for the same two messages.
    assert channels.waiting.bytes == 2 * (800 + 200)
    for client in clients[:2]:
        one.write(bytes(1800))
        client.take()  # it takes no more
    assert channels.waiting.bytes <= 10_000
    assert cut == []
    for k in range(50):
        one.write(bytes(1800))
        two.write(bytes(100 * k))
        assert channels.waiting.bytes <= 10_000
    # What was lost without a newer message is asked for when the client goes on.
    for client in clients:
        while client.take() is not None:
            pass
    assert channels.waiting.bytes == 0
    assert one.take_missed()
    assert one.take_key()
    for client in clients:
        client.leave()
    assert channels.waiting.bytes == 0


def test_a_client_that_holds_a_large_message_makes_room_for_others():
    """Messages on their way count: who has had one for longest is cut off."""
    channels = Channels("/node", str)
    channels.waiting = Waiting(10_000)
    channel = channels.channel("/one", "a_msgs/msg/B")
    cut = []
    for k in range(3):
        client = channels.join(lambda: None, lambda k=k: cut.append(k))
        while client.take() is not None:
            pass
        client.subscribe(0, channel.number)
        # Each takes a message of its own, which does not go out.
        channel.write(bytes(1800))
        assert client.take() is not None
        client.unsubscribe(0)
    assert cut == [0]
    assert channels.waiting.bytes == 2 * (1800 + 200)
