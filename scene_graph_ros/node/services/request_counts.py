"""How many requests came, and how many of them were refused."""

from __future__ import annotations

import threading

__all__ = ["RequestCounts"]


class RequestCounts:
    """Counts of all services together; any thread may count."""

    def __init__(self) -> None:
        """Begin with none."""
        self._lock = threading.Lock()
        self.requests = self.refused = 0

    def answered(self) -> None:
        """Count a request that was answered as it wanted."""
        with self._lock:
            self.requests += 1

    def was_refused(self) -> None:
        """Count a request that was refused."""
        with self._lock:
            self.requests += 1
            self.refused += 1
