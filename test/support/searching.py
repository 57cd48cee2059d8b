"""How long random searches go on: briefly in each run of the tests, and long in ``make search``.

Tests that search, or wait for what shows in the long run, have the mark ``search``; what each of
them tries is multiplied.
"""

from __future__ import annotations

import os

__all__ = ["times"]

_EFFORT = int(os.environ.get("SEARCH_EFFORT", "1"))


def times(count: int) -> int:
    """Return how many cases to try, where a run of all tests tries ``count``."""
    return count * _EFFORT
