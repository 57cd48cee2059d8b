"""Vertices and edges of a graph, and their terms as rows and cones."""
