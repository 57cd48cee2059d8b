"""Drawings of a scene as plain data, and views that show them. No messages, no ROS."""
