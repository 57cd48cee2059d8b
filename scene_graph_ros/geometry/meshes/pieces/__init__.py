"""Meshes taken apart into convex pieces: which, kept where, and how far they leave the solid."""
