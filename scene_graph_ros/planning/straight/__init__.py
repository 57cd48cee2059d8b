"""Motions that lead a tool along lines and arcs."""
