"""Work cut into shares, for any executor; the share of a worker that died is done again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from typing import Any, TypeAlias, TypeVar
import warnings

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.planning.parallel.deadline import Deadline, ENDLESS

__all__ = ["AnyExecutor", "checked_executor", "in_executor", "parts_of"]

AnyExecutor: TypeAlias = Executor | Callable[[], Executor]
"""An executor, or what makes one: then another one is made where workers died."""

_MOST_EXECUTORS = 3
"""That are made for one piece of work; then a share has killed as many workers."""

_PARTS = 64
"""Of a piece of work, at least: as many workers as that are kept busy."""

_TURN = 0.05
"""Seconds between two looks at a deadline."""

Result = TypeVar("Result")


def parts_of(count: int, least: int, most: int) -> list[tuple[int, int]]:
    """Return begins and ends of parts of so many items, for any number of workers.

    Each has ``most`` items, or fewer where that makes less than 64 parts, but ``least`` of them.
    """
    size = min(max(-(-count // _PARTS), least), most)
    return [(first, min(first + size, count)) for first in range(0, count, size)]


def checked_executor(executor: Any) -> AnyExecutor | None:
    """Return an executor, its factory, or None. Raises CollisionCheckerError."""
    if executor is None or isinstance(executor, Executor) or callable(executor):
        return executor
    raise CollisionCheckerError(
        "executor must be a concurrent.futures.Executor, or a function that makes one, not"
        f" {quoted(executor)}"
    )


def in_executor(
    function: Callable[..., Result],
    shares: Sequence[tuple[Any, ...]],
    executor: AnyExecutor | None,
    deadline: Deadline = ENDLESS,
    what: str = "not done",
) -> list[Result]:
    """Return the answers of a function of a module to each part's arguments, in their order.

    A process pool is broken when one of its workers dies. Its unfinished parts are done again: by
    another pool where ``executor`` makes them, at most three in all, else by this process, which a
    RuntimeWarning tells. Executors that replace their workers themselves, as dask's, do so. Errors
    of the function are raised, and the parts that have not begun are dropped; so they are where a
    ``deadline`` is over, which raises OutOfTimeError with ``what``.
    """
    if executor is None:
        answers = []
        for share in shares:
            deadline.check(what)
            answers.append(function(*share))
        return answers
    done: dict[int, Result] = {}
    if isinstance(executor, Executor):
        if _collect(function, shares, executor, done, deadline, what) is not None:
            left = len(shares) - len(done)
            warnings.warn(
                f"workers of the executor died: {left} of {len(shares)} shares are done by this"
                " process. An executor that is given as a function is made anew",
                RuntimeWarning,
                stacklevel=3,
            )
            for k in range(len(shares)):
                if k not in done:
                    deadline.check(what)
                    done[k] = function(*shares[k])
        return [done[k] for k in range(len(shares))]
    for attempt in range(_MOST_EXECUTORS):
        with _made(executor) as pool:
            broken = _collect(function, shares, pool, done, deadline, what)
        if broken is None:
            break
        if attempt == _MOST_EXECUTORS - 1:
            raise broken
    return [done[k] for k in range(len(shares))]


def _made(make: Callable[[], Executor]) -> Executor:
    pool = make()
    if not isinstance(pool, Executor):
        raise CollisionCheckerError(
            f"executor must make a concurrent.futures.Executor, not {quoted(pool)}"
        )
    return pool


def _collect(
    function: Callable[..., Result],
    shares: Sequence[tuple[Any, ...]],
    pool: Executor,
    done: dict[int, Result],
    deadline: Deadline,
    what: str,
) -> BrokenExecutor | None:
    """Note a pool's answers to the parts that are not done; return its fault, if any."""
    futures: dict[int, Future[Result]] = {}
    broken: BrokenExecutor | None = None
    try:
        for k in range(len(shares)):
            if k not in done:
                futures[k] = pool.submit(function, *shares[k])
    except BrokenExecutor as error:
        broken = error
    try:
        for k, future in futures.items():
            try:
                while deadline.is_set and not wait([future], _TURN).done:
                    deadline.check(what)
                done[k] = future.result()
            except BrokenExecutor as error:
                broken = error
    except BaseException:
        for future in futures.values():
            future.cancel()
        raise
    return broken
