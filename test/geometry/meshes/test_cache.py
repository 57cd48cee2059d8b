"""The memory of what was built, after interrupts."""

from functools import partial

from interrupting import instruction_count, interrupted_at

from scene_graph_ros.geometry.meshes.cache import BuildCache


def test_a_thread_that_was_interrupted_may_come_again():
    """Wherever it was, it does not wait for itself, and gets what is built."""

    def ask(cache):
        return cache.get("key", lambda: "built")

    for at in range(instruction_count(partial(ask, BuildCache(2)))):
        cache = BuildCache(2)
        interrupted_at(partial(ask, cache), at)
        assert cache._lock.acquire(blocking=False), at
        cache._lock.release()
        assert ask(cache) == "built"


def test_the_least_recently_used_go_first():
    """Of three entries two stay, and what stays is not built again."""
    cache, built = BuildCache(2), []
    for key in ("a", "b", "a", "c", "a", "b"):
        assert cache.get(key, lambda key=key: built.append(key) or key) == key
    assert built == ["a", "b", "c", "b"]
