"""Both ways to the shortest path: one by one where paths are few, and by relaxation and search."""

from __future__ import annotations

import pytest

from scene_graph_ros.convex.graphs.search import few_paths


@pytest.fixture(params=["few paths", "search"])
def both_ways_to_paths(request, monkeypatch):
    """Run a test both ways: graphs of tests have few paths, which would all be solved."""
    if request.param == "search":
        monkeypatch.setattr(few_paths, "_MOST_EDGES", 0)
