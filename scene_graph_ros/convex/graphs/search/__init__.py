"""Shortest paths through a graph: searches, and their results."""
