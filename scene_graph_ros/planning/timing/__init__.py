"""Timed trajectories along paths and curves, proven free."""
