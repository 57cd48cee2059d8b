"""Robots and the scene that they are in, as one model."""
