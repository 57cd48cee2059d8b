"""Two nodes of one name: both say so."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import diagnostics_values


def world(message):
    """Return the entry of the world."""
    return next(status for status in message.status if status.name.endswith(": world"))


def test_a_second_node_of_the_same_name_is_warned_about(client, start_node):
    """By both nodes, in the log and in the diagnostics, until it goes."""
    first = start_node({"diagnostics_rate": 20.0})
    second = start_node({"diagnostics_rate": 0.1})
    elsewhere = start_node({"diagnostics_rate": 0.1}, remaps=["__ns:=/cell"])
    for node in (first, second):
        node.wait_for_output("another node is called '/scene_graph', too")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    message = diagnostics.wait_for(
        lambda m: diagnostics_values(m, "world").get("nodes of the same name") == "1", "the count"
    )
    assert world(message).level == DiagnosticStatus.WARN
    assert "/scene_graph" in world(message).message
    assert second.stop() == 0
    first.wait_for_output("1 of the nodes called '/scene_graph', too, went")
    message = diagnostics.wait_for_newest(
        lambda m: diagnostics_values(m, "world").get("nodes of the same name") == "0", "the count"
    )
    assert world(message).level == DiagnosticStatus.OK
    assert "another node" not in elsewhere.output()
    client.forget(diagnostics)
