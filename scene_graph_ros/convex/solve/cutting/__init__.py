"""Decisions about rows and cones: planes cut the cones out."""
