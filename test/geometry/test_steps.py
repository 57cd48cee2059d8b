"""What is called between the steps of long work, as the one who started it said."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from scene_graph_ros.geometry.steps import between_steps, calling_between_steps


def test_only_what_was_started_so_is_interrupted():
    """Neither what comes before and after, nor what another thread does meanwhile."""
    calls = []
    between_steps()
    with ThreadPoolExecutor(1) as pool, calling_between_steps(lambda: calls.append("outer")):
        between_steps()
        pool.submit(between_steps).result()
        with calling_between_steps(lambda: calls.append("inner")):
            between_steps()
        between_steps()
    between_steps()
    assert calls == ["outer", "inner", "outer"]


def test_work_that_fails_ends_the_interruptions():
    """Of what comes after nothing is heard."""
    calls = []
    with pytest.raises(ZeroDivisionError), calling_between_steps(lambda: calls.append(1)):
        raise ZeroDivisionError
    between_steps()
    assert calls == []
