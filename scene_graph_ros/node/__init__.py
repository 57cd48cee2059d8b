"""Anything ROS: the node that wires the geometry core to topics, services and parameters.

Only this folder imports rclpy. ``world`` keeps what is known, ``effects`` publish it, ``services``
answer requests, and ``runtime`` is what all of them run on; ``server`` puts them together.
``runtime.parameters``, its checks and ``runtime.names`` can be read without rclpy.
"""
