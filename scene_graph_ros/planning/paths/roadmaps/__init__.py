"""Roadmaps, and the search for a path in one."""
