"""ROS domains for tests: nobody else on this machine uses the same one meanwhile."""

from __future__ import annotations

from contextlib import AbstractContextManager
import itertools
import random

import domain_coordinator

__all__ = ["own_domain"]

_NUMBERS = itertools.cycle(random.sample(range(1, 101), 100))
"""In an order of its own for each process. Where a node was killed, others believe for 20 s that
it is there, and ask it: so a domain is used again only after all others."""


def own_domain() -> AbstractContextManager[int]:
    """Reserve a domain and return its number, to be used in a ``with`` statement."""
    domain: AbstractContextManager[int] = domain_coordinator.domain_id(lambda: next(_NUMBERS))
    return domain
