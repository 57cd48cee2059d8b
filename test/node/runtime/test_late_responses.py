"""A response reaches its client also where discovery tells of the client later than it asked."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
import threading
import warnings

from lifecycle_msgs.srv import GetState
from node_harness import wait_until
import pytest
from rclpy.exceptions import InvalidHandle
from rclpy.qos import DurabilityPolicy, QoSProfile

from scene_graph_msgs.srv import HasCollisions
from scene_graph_ros.node.runtime.late_responses import LateResponses

DROPPED = "the middleware does not know its client"


class Middleware:
    """Knows the client from the ``known_at``-th try on."""

    def __init__(self, known_at):
        self.known_at, self.tries = known_at, 0
        self.sent = threading.Event()

    def send(self):
        """Do as rclpy does where a warning is an error."""
        self.tries += 1
        if self.tries < self.known_at:
            raise SystemError("returned a result with an exception set") from RuntimeWarning(
                "failed to send response (timeout)"
            )
        self.sent.set()


@pytest.fixture
def warnings_said():
    """What was warned about."""
    return []


@pytest.fixture
def late(warnings_said):
    """Responses that are given up only after a test's time."""
    late = LateResponses(warnings_said.append, patience=60.0)
    yield late
    late.close()


def late_threads():
    """Return the threads that wait for clients."""
    return [thread for thread in threading.enumerate() if thread.name == "late responses"]


def test_a_known_client_costs_no_thread(late):
    """What can be sent is sent at once."""
    middleware = Middleware(known_at=1)
    late.send("/ask", middleware.send)
    assert middleware.sent.is_set()
    assert not late_threads()


def test_responses_are_sent_again_until_their_clients_are_known(late, warnings_said):
    """Each once, and the thread that does it ends."""
    clients = [Middleware(known_at) for known_at in (2, 3, 5)]
    for client in clients:
        late.send("/ask", client.send)
    for client in clients:
        wait_until(client.sent.is_set, "the response")
    wait_until(lambda: not late_threads(), "the end of the thread")
    assert [client.tries for client in clients] == [2, 3, 5]
    assert not warnings_said


def test_a_client_that_never_becomes_known_is_given_up(warnings_said):
    """With a warning that names the service and what may be wrong; another is still answered."""
    late = LateResponses(warnings_said.append, patience=0.2)
    # A try comes before patience is looked at, however late it is.
    known = Middleware(known_at=2)
    late.send("/ask", Middleware(known_at=1_000_000).send)
    late.send("/other", known.send)
    wait_until(lambda: not late_threads(), "the end of the thread")
    assert known.sent.is_set()
    (text,) = warnings_said
    assert text.startswith("a response of /ask is dropped")
    assert "0.2 s" in text
    late.close()


def test_so_many_are_kept_and_no_more(late, warnings_said):
    """Something that asks on and on without ever becoming known takes no memory."""
    for _ in range(103):
        late.send("/ask", Middleware(known_at=1_000_000).send)
    assert len(warnings_said) == 3
    assert "100 others wait" in warnings_said[0]


def test_a_response_that_is_being_tried_counts_as_kept(late, warnings_said):
    """While one is at the middleware again, there is room for 99 others."""
    is_tried, may_end = threading.Event(), threading.Event()

    class Halted(Middleware):
        def send(self):
            if self.tries:
                is_tried.set()
                assert may_end.wait(60.0)
            super().send()

    late.send("/ask", Halted(known_at=2).send)
    assert is_tried.wait(60.0)
    for _ in range(100):
        late.send("/ask", Middleware(known_at=1_000_000).send)
    may_end.set()
    assert len(warnings_said) == 1


def test_threads_make_the_warning_an_error_once(late, monkeypatch):
    """While one does, another waits: to do it again takes it back for a moment."""
    made, others = [], []
    make = warnings.filterwarnings

    def make_while_another_sends(*arguments):
        made.append(threading.current_thread())
        if len(made) == 1:
            others.append(pool.submit(late.send, "/ask", Middleware(known_at=1).send))
            # It is done at once where nothing holds it up.
            wait(others, 0.2)
        make(*arguments)

    with warnings.catch_warnings(), ThreadPoolExecutor(1) as pool:
        warnings.resetwarnings()
        monkeypatch.setattr(warnings, "filterwarnings", make_while_another_sends)
        late.send("/ask", Middleware(known_at=1).send)
        others[0].result(60.0)
    assert made == [threading.current_thread()]


def test_the_end_does_not_wait_for_clients(warnings_said):
    """What waits is forgotten, without a word, and nothing is sent after that."""
    late = LateResponses(warnings_said.append, patience=60.0)
    client = Middleware(known_at=1_000_000)
    late.send("/ask", client.send)
    late.close()
    assert not late_threads()
    tries = client.tries
    late.send("/ask", client.send)
    assert client.tries == tries + 1
    assert not late_threads()
    assert not warnings_said


def test_other_failures_are_told(late, warnings_said):
    """At once to whoever sends; later, in a warning."""

    def fail():
        raise SystemError("something else")

    with pytest.raises(SystemError, match="something else"):
        late.send("/ask", fail)

    class Broken(Middleware):
        def send(self):
            if self.tries:
                raise ValueError("not a response")
            super().send()

    late.send("/ask", Broken(known_at=2).send)
    wait_until(lambda: warnings_said, "the warning")
    assert "not a response" in warnings_said[0]


def test_a_service_that_is_gone_needs_no_response(late):
    """Nobody could get it."""

    def gone():
        raise InvalidHandle

    late.send("/ask", gone)
    assert not late_threads()


def test_clients_that_do_not_match_are_told_of_and_others_answered(client, start_node):
    """A reader that wants responses kept for it never matches: the node never knows its client.

    True of the node's own services, and of those that rclpy answers for every node.
    """
    node = start_node()
    odd = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    for kind, name in ((HasCollisions, "has_collisions"), (GetState, "get_state")):
        stranger = client.node.create_client(kind, f"/scene_graph/{name}", qos_profile=odd)
        text = f"a response of /scene_graph/{name} is dropped"

        def is_said(ask=stranger, request=kind.Request, text=text):
            ask.call_async(request())
            return text in node.output()

        wait_until(is_said, f"'{text}' in the node's output")
        assert DROPPED in node.output()
        answer = client.call_any(kind, f"/scene_graph/{name}", kind.Request())
        assert isinstance(answer, kind.Response)
        client.destroy(stranger)
    assert node.stop() == 0
    assert "Traceback" not in node.output()
