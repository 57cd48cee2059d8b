"""Signed distance between two shapes: one kernel per pair of shapes, and their dispatch."""
