"""Decisions about rows in rational arithmetic."""
