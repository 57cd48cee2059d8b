"""Graphs of convex sets: shortest paths through them, with bounds that are proven."""
