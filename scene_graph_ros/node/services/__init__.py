"""Requests of clients: what is answered, from which snapshot, and when."""
