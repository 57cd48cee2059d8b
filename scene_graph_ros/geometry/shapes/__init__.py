"""Shapes: one file each, without pose, role or picture."""
