"""Algorithms on convex cores that are not about one pair of shapes."""
