"""The threads that answer requests: side by side, the exclusive ones one after another."""

from __future__ import annotations

import threading
import time

from node_harness import Client, DEADLINE, wait_until
import pytest
import rclpy
from std_srvs.srv import Empty

from scene_graph_ros.node.runtime.requests import RequestLoop


@pytest.fixture(scope="module")
def node(domain):
    """A node that no executor spins."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("answers", context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


LIMIT = 30


class Loop(RequestLoop):
    """Offers services that take nothing, and notes what was refused."""

    def __init__(self, node, threads):
        super().__init__(node, threads=threads, most_waiting=lambda: LIMIT)
        self.refused = []

    def offer(self, kind, name, answer, *, is_exclusive=False):
        """Offer a service."""

        def refuse(error):
            self.refused.append(str(error))
            return Empty.Response()

        super().offer(kind, name, answer, refuse=refuse, is_exclusive=is_exclusive)


@pytest.fixture
def loop(node):
    """Two threads; start it when the services are offered."""
    loop = Loop(node, threads=2)
    yield loop
    loop.close()


def at_once(callback):
    """Return what answers after a callback."""

    def answer(request, respond):
        callback()
        respond(Empty.Response())

    return answer


def call(client: Client, name, count=1):
    """Send some requests at once and return the futures of their answers."""
    return [client.start_call(Empty, f"/answers/{name}", Empty.Request()) for _ in range(count)]


def answered(futures):
    """Wait until all are answered."""
    wait_until(lambda: all(future.done() for future in futures), "all answers")


def test_requests_are_answered_side_by_side(loop, client):
    """Two requests meet in their answers, which they could not one after another."""
    barrier = threading.Barrier(2, timeout=DEADLINE)
    loop.offer(Empty, "~/meet", at_once(barrier.wait))
    loop.start()
    answered(call(client, "meet", 2))
    assert not barrier.broken


def test_exclusive_requests_leave_a_thread_to_the_others(loop, client):
    """Of three exclusive ones, of two services, one runs at a time; others pass them by."""
    running, most, gate = [], [], threading.Event()

    def work():
        running.append(1)
        most.append(len(running))
        assert gate.wait(DEADLINE)
        running.pop()

    for name in ("change", "edit"):
        loop.offer(Empty, f"~/{name}", at_once(work), is_exclusive=True)
    loop.offer(Empty, "~/ask", at_once(lambda: None))
    loop.start()
    changes = [*call(client, "change", 2), *call(client, "edit")]
    wait_until(lambda: running, "the first change")
    answered(call(client, "ask", 5))
    assert not any(change.done() for change in changes)
    gate.set()
    answered(changes)
    assert most == [1, 1, 1]


@pytest.mark.parametrize("is_exclusive", [False, True])
def test_what_is_too_much_is_refused_at_once_while_all_threads_are_busy(
    loop, client, is_exclusive
):
    """As many wait as may; the others are told, long before a thread is free."""
    gate, running = threading.Event(), []

    def work():
        running.append(1)
        assert gate.wait(DEADLINE)

    loop.offer(Empty, "~/slow", at_once(work), is_exclusive=is_exclusive)
    loop.start()
    busy = 1 if is_exclusive else 2
    futures = call(client, "slow", busy)
    wait_until(lambda: len(running) == busy, "busy threads")
    futures += call(client, "slow", LIMIT + 7)
    wait_until(lambda: len(loop.refused) == 7, "seven refusals")
    wait_until(lambda: sum(future.done() for future in futures) == 7, "their answers")
    assert set(loop.refused) == {
        f"{LIMIT} requests wait already, and max_waiting_requests is {LIMIT}"
    }
    assert len(running) == busy
    gate.set()
    answered(futures)
    assert len(running) == busy + LIMIT


def test_what_is_posted_and_the_alarm_are_done_by_the_threads(loop):
    """Both run, the alarm when its time has come, and once; a later one replaces an earlier."""
    done: list[tuple[str, str, float]] = []

    def note(what):
        done.append((what, threading.current_thread().name, time.monotonic()))

    loop.start()
    begin = time.monotonic()
    loop.set_alarm(begin + 3600.0, lambda: note("never"))
    loop.set_alarm(begin + 0.2, lambda: note("alarm"))
    loop.post(lambda: note("post"))
    wait_until(lambda: len(done) == 2, "both")
    # Whichever comes first: a thread may be held up until the alarm's time has come.
    (alarm, *by_alarm), (post, *by_post) = sorted(done)
    assert (alarm, post) == ("alarm", "post")
    assert by_alarm[0].startswith("requests") and by_post[0].startswith("requests")
    assert by_alarm[1] >= begin + 0.2


def test_a_fault_ends_nothing(loop, client):
    """After an answer that raises, and a task that does, requests are answered."""
    loop.offer(Empty, "~/fail", at_once(lambda: 1 / 0))
    loop.offer(Empty, "~/fine", at_once(lambda: None))
    loop.start()
    loop.post(lambda: 1 / 0)
    failed = call(client, "fail", 3)
    answered(call(client, "fine", 2))
    assert not any(future.done() for future in failed)


def test_an_answer_may_come_later(loop, client):
    """The response is sent by another thread, when that has it."""
    kept = []
    loop.offer(Empty, "~/later", lambda request, respond: kept.append(respond))
    loop.start()
    (future,) = call(client, "later")
    wait_until(lambda: kept, "the request")
    assert not future.done()
    kept[0](Empty.Response())
    answered([future])


def test_after_the_end_no_thread_is_left(node):
    """Closing ends all threads, whatever they wait for, and can be done again."""
    loop = Loop(node, threads=3)
    loop.offer(Empty, "~/gone", at_once(lambda: None))
    loop.start()
    before = {t for t in threading.enumerate() if t.name.startswith("requests")}
    # One waits while three answer.
    assert len(before) == 4
    loop.close()
    loop.close()
    assert not any(thread.is_alive() for thread in before)
    loop.post(lambda: None)
