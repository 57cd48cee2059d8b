"""Convex sets, and what can be proven of them."""
