"""The memory of what was built, after interrupts."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
import threading

from interrupting import instruction_count, interrupted_at

from scene_graph_ros.geometry.meshes.cache import BuildCache


def test_after_an_interrupt_every_thread_gets_an_answer():
    """Wherever it was, nobody waits for the thread that was interrupted."""

    def ask(cache):
        return cache.get("key", lambda: "built")

    with ThreadPoolExecutor(1) as other:
        for at in range(instruction_count(partial(ask, BuildCache(2)))):
            cache = BuildCache(2)
            interrupted_at(partial(ask, cache), at)
            assert other.submit(ask, cache).result(timeout=60.0) == "built", at
            assert ask(cache) == "built"


def test_threads_that_build_at_the_same_time_get_the_same_value():
    """The first that has ended gives it to all; never more are kept than there is room for."""
    cache, barrier = BuildCache(3), threading.Barrier(4)

    def ask(_):
        barrier.wait(60.0)
        return [cache.get(key, object) for key in (1, 2, 3, 1, 2, 3)]

    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(ask, range(4)))
    assert all(row == rows[0] for row in rows)
    for key in range(100):
        cache.get(key, object)
    assert len(cache._entries) == 3


def test_the_least_recently_used_go_first():
    """Of three entries two stay, and what stays is not built again."""
    cache, built = BuildCache(2), []
    for key in ("a", "b", "a", "c", "a", "b"):
        assert cache.get(key, lambda key=key: built.append(key) or key) == key
    assert built == ["a", "b", "c", "b"]
