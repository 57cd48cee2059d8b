"""Geometry world for ROS 2: sources register geometry and publish poses; queries answer."""
