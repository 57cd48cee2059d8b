"""Convex sets, regions, graphs and the solvers that decide about them.

``scene_graph_ros.geometry.optimization`` has the public names.
"""
