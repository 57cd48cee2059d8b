"""Retimers of others, whose motions we check and prove."""
