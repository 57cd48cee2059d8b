"""The rounding that limits of positions allow."""

__all__ = ["LIMIT_ROUNDING", "RATE_ROUNDING"]

LIMIT_ROUNDING = 1e-9
"""rad or m: positions that are beyond a limit by less are at it."""

RATE_ROUNDING = 1e-12
"""Of a limit: rates that are beyond it by less are at it, as where a motion begins at a limit."""
