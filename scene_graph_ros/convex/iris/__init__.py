"""Regions free of convex obstacles, grown from a point."""
