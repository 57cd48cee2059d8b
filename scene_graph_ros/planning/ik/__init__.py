"""Configurations that put a tool where a target says."""
