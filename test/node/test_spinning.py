"""The tests' own client: nothing it destroys ends its thread, and where that ends a test fails."""

from __future__ import annotations

import sys

from node_harness import Client
import pytest
from rclpy.event_handler import PublisherEventCallbacks
from spinning import DEADLINE, wait_until
from std_msgs.msg import Empty
from std_srvs.srv import Empty as EmptyService

ROUNDS = 100
"""Where the test's thread destroys entities itself, a few of these end the thread that spins."""


@pytest.fixture
def switching():
    """Threads take turns as often as they can, so that what may come between does."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


@pytest.fixture
def busy_client(domain, switching):
    """A client whose thread always has something to do, and so always looks at all entities."""
    client = Client(domain)
    publisher = client.node.create_publisher(Empty, "/round", 10)
    rounds = client.listen(Empty, "/round")
    client.node.create_timer(1e-4, lambda: publisher.publish(Empty()))
    wait_until(lambda: rounds.count, "the first message")
    yield client, rounds
    client.close()


def test_what_a_client_destroys_does_not_end_its_thread(busy_client):
    """Publishers, subscriptions and clients come and go while the thread turns; it goes on."""
    client, rounds = busy_client
    node, callbacks = client.node, PublisherEventCallbacks(matched=lambda event: None)
    for _ in range(ROUNDS):
        entities = [
            node.create_publisher(Empty, "/a", 1, event_callbacks=callbacks),
            node.create_subscription(Empty, "/b", print, 1),
            node.create_client(EmptyService, "/c"),
        ]
        # The thread turns meanwhile, so that it knows them.
        count = rounds.count
        wait_until(lambda count=count: rounds.count > count, "another round")
        for entity in entities:
            client.destroy(entity)
    listener = client.listen(Empty, "/round")
    listener.wait_for(lambda message: True, "a message after all that")


def test_a_failure_of_the_thread_fails_the_test_at_once(domain):
    """Whoever waits for what never comes is told why, long before the deadline."""
    client = Client(domain)

    def fail(message):
        raise ZeroDivisionError("a callback that fails")

    try:
        client.node.create_subscription(Empty, "/fails", fail, 1)
        client.publisher(Empty, "/fails").publish(Empty())
        with pytest.raises(AssertionError, match="a callback that fails"):
            wait_until(lambda: False, "what never comes", 100.0 * DEADLINE)
    finally:
        with pytest.raises(AssertionError, match="a callback that fails"):
            client.close()


def test_a_task_that_fails_is_told_and_ends_nothing(domain):
    """What is done in the thread raises where it was asked for, and the thread goes on."""
    client = Client(domain)
    publisher = client.node.create_publisher(Empty, "/once", 1)
    client.destroy(publisher)
    with pytest.raises(AssertionError, match="no <rclpy"):
        client.destroy(publisher)
    client.destroy(client.node.create_publisher(Empty, "/again", 1))
    client.close()
