"""Whoever can answer: each engine in its own module, all with the interface of ``engine``."""
