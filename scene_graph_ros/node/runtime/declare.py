"""Declares the table of parameters on a node and keeps their values at hand."""

from __future__ import annotations

import threading
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.runtime.parameter import GIVEN_BY_ROS, Parameter
from scene_graph_ros.node.runtime.parameter_checks import validate
from scene_graph_ros.node.runtime.parameters import PARAMETERS

__all__ = ["NodeParameters", "descriptor"]


_KNOWN = {*(p.name for p in PARAMETERS), *GIVEN_BY_ROS}

_SET = "set"
"""What others are told of a parameter that is secret, if it was given."""


def descriptor(parameter: Parameter) -> ParameterDescriptor:
    """Return a parameter's descriptor."""
    text = parameter.description
    if parameter.choices:
        text += f" One of: {', '.join(parameter.choices)}."
    result = ParameterDescriptor(
        name=parameter.name, description=text, read_only=parameter.read_only
    )
    if parameter.minimum is None or parameter.maximum is None:
        return result
    if isinstance(parameter.default, float):
        result.floating_point_range = [
            FloatingPointRange(
                from_value=float(parameter.minimum), to_value=float(parameter.maximum), step=0.0
            )
        ]
    else:
        result.integer_range = [
            IntegerRange(
                from_value=int(parameter.minimum), to_value=int(parameter.maximum), step=1
            )
        ]
    return result


def _hide(node: Node, parameter: Parameter) -> Any:
    """Return the value that the node was started with, and have others be told that it is set."""
    # rclpy tells all of it to whoever asks, and on /parameter_events: it must not get to know it.
    given = node._parameter_overrides.get(parameter.name)
    if given is None or given.value == parameter.default:
        return parameter.default
    node._parameter_overrides[parameter.name] = RosParameter(parameter.name, value=_SET)
    return given.value


class NodeParameters:
    """The node's parameters: declared, validated together, and read without a lock."""

    def __init__(self, node: Node) -> None:
        """Declare all parameters; raises ValueError with all faults of their values."""
        self._numbers = {p.name for p in PARAMETERS if isinstance(p.default, float)}
        overrides = node._parameter_overrides
        overrides.update({p.name: p for p in self._as_numbers(list(overrides.values()))})
        for name in overrides:
            if name.partition(".")[0] not in _KNOWN:
                hint = suggestion(name, [p.name for p in PARAMETERS])
                node.get_logger().warning(
                    f"parameter {quoted(name)} is unknown, and ignored{hint}"
                )
        secrets = {p.name: _hide(node, p) for p in PARAMETERS if p.is_secret}
        for parameter in PARAMETERS:
            node.declare_parameter(parameter.name, parameter.default, descriptor(parameter))
        self._taking = threading.Lock()
        self._values = {p.name: node.get_parameter(p.name).value for p in PARAMETERS} | secrets
        problems = validate(self._values)
        if problems:
            raise ValueError("; ".join(problems))
        node.add_pre_set_parameters_callback(self._as_numbers)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._take)

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def _as_numbers(self, parameters: list[RosParameter]) -> list[RosParameter]:
        """Return parameters with whole numbers as doubles where these are asked for."""
        return [
            RosParameter(p.name, RosParameter.Type.DOUBLE, float(p.value))
            if p.name in self._numbers and p.type_ is RosParameter.Type.INTEGER
            else p
            for p in parameters
        ]

    def _ours(self, parameters: list[RosParameter]) -> dict[str, Any]:
        return {p.name: p.value for p in parameters if p.name in self._values}

    def _check(self, parameters: list[RosParameter]) -> SetParametersResult:
        problems = validate(self._ours(parameters), self._values)
        return SetParametersResult(successful=not problems, reason="; ".join(problems))

    def _take(self, parameters: list[RosParameter]) -> None:
        # A program that embeds the node may set some while a service sets others.
        with self._taking:
            self._values = {**self._values, **self._ours(parameters)}
