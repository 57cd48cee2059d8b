"""Pairs of bodies: their shapes, and how far apart they are at least."""
