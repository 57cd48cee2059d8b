"""The rounding that limits of positions allow."""

__all__ = ["LIMIT_ROUNDING"]

LIMIT_ROUNDING = 1e-9
"""rad or m: positions that are beyond a limit by less are at it."""
