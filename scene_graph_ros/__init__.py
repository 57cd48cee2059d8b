"""Geometry world for ROS 2: sources register geometry and publish poses; queries answer."""

__all__ = ["__version__"]

__version__ = "0.1.0"
