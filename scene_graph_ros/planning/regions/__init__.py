"""Convex regions of configurations that are free, as sure as samples can tell."""
