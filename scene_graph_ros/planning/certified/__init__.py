"""Convex regions of configurations that are proven free, and their certificates."""
