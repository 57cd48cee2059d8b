"""Values of parameters that are set from several threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait

from rclpy.parameter import Parameter

from scene_graph_ros.node.runtime.declare import NodeParameters
from scene_graph_ros.node.runtime.parameters import defaults


class Node:
    """As much of a node as its parameters need."""

    def __init__(self):
        self.values = {}
        self._parameter_overrides = {}
        self.take = None

    def declare_parameter(self, name, default, descriptor):
        """Take the default."""
        self.values[name] = Parameter(name, value=default)

    def get_parameter(self, name):
        """Return a parameter."""
        return self.values[name]

    def add_pre_set_parameters_callback(self, callback):
        """Let nobody change what is set."""

    def add_on_set_parameters_callback(self, callback):
        """Let nobody be asked."""

    def add_post_set_parameters_callback(self, callback):
        """Remember who is told."""
        self.take = callback


def test_what_two_threads_set_is_all_there():
    """One that begins while another is at it takes nothing back."""
    node = Node()
    parameters = NodeParameters(node)
    others = []

    class Interrupted(list):
        """Parameters that are being read when another thread sets some."""

        def __iter__(self):
            others.append(pool.submit(node.take, [Parameter("min_update_rate", value=3.0)]))
            # It is done at once where nothing holds it up.
            wait(others, 0.2)
            return super().__iter__()

    with ThreadPoolExecutor(1) as pool:
        node.take(Interrupted([Parameter("marker_rate", value=7.0)]))
        others[0].result(60.0)
    assert (parameters["marker_rate"], parameters["min_update_rate"]) == (7.0, 3.0)
    assert parameters["max_wait"] == defaults()["max_wait"]
