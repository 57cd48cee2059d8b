"""The convex relaxation of a shortest path, and its bounds."""
