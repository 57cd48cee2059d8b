"""Requests of clients: their answers, the snapshots behind these, and their order."""
