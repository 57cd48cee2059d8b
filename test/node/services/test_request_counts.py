"""Requests that several threads count."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from scene_graph_ros.node.services.request_counts import RequestCounts


@pytest.mark.parametrize("name", ["answered", "was_refused"])
def test_two_threads_that_count_at_once_count_two(name):
    """One that begins while another is at it is not written over."""
    counts, others = RequestCounts(), []

    class Interrupted(int):
        """A number that another thread adds to when one does."""

        def __add__(self, more):
            others.append(pool.submit(getattr(counts, name)))
            # It is done at once where nothing holds it up.
            wait(others, 0.2)
            return int(self) + more

    counts.requests = Interrupted(0)
    with ThreadPoolExecutor(1) as pool:
        getattr(counts, name)()
        others[0].result(60.0)
    assert counts.requests == 2
    assert counts.refused == (2 if name == "was_refused" else 0)
