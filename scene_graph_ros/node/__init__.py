"""Anything ROS: the node that wires the geometry core to topics, services and parameters.

Only this folder imports rclpy. ``parameters`` and ``names`` can be read without it.
"""
