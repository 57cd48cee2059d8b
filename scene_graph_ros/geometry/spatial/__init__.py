"""Poses and vectors, without shapes."""
