"""Geometry world for ROS 2: sources register frames and geometry and publish poses; queries answer."""
