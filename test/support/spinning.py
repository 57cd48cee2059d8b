"""An executor in a thread of its own, for tests: what it waits for is destroyed in its thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
import contextlib
import threading
import time
import traceback
from typing import Any

from rclpy.executors import ExternalShutdownException

__all__ = ["DEADLINE", "SpinningThread", "wait_until"]

DEADLINE = 120.0
"""Seconds after which a test gives up waiting: far more than anything takes on a busy machine."""

_running: list[SpinningThread] = []


def wait_until(condition: Callable[[], Any], what: str, timeout: float = DEADLINE) -> Any:
    """Poll until ``condition`` is true and return it; fail after the deadline, naming ``what``.

    Fails at once where a thread that spins has failed: nothing would come any more.
    """
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        result = condition()
        if result:
            return result
        for thread in _running:
            thread.check(what)
        time.sleep(0.01)
    raise AssertionError(f"not within {timeout} s: {what}")


class SpinningThread:
    """Spins an executor until it is closed.

    rclpy looks at the handles of all entities while it builds what it waits for, and again after
    each wait; one that another thread destroys meanwhile makes it raise InvalidHandle. So `run`
    has that done here, between two rounds.
    """

    def __init__(self, executor: Any) -> None:
        self.executor = executor
        self.rounds = 0
        self._failure = ""
        self._is_stopped = False
        self._tasks: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._thread = threading.Thread(target=self._run, name="spinning", daemon=True)
        _running.append(self)
        self._thread.start()

    def run(self, task: Callable[[], Any], what: str) -> Any:
        """Do something in the thread, and return what that returns."""
        future: Future[Any] = Future()
        self._tasks.append((task, future))
        self._wake()
        wait_until(future.done, what)
        return future.result()

    def check(self, what: str) -> None:
        """Fail where the thread has failed; ``what`` is what it is needed for."""
        if self._failure:
            raise AssertionError(f"no {what}: the thread that spins failed:\n{self._failure}")

    def close(self) -> None:
        """End the thread and the executor; what it waited for can then be destroyed anywhere."""
        self._is_stopped = True
        if self._thread.is_alive():
            self._wake()
        self._thread.join(DEADLINE)
        _running.remove(self)
        self.executor.shutdown()
        self.check("clean end")
        assert not self._thread.is_alive(), "the thread that spins does not end"

    def _wake(self) -> None:
        # Only work makes an executor return; ``wake`` makes it look again at what it waits for.
        self.executor.create_task(lambda: None)

    def _run(self) -> None:
        try:
            with contextlib.suppress(ExternalShutdownException):
                while not self._is_stopped:
                    self.executor.spin_once()
                    self.rounds += 1
                    self._do_tasks()
        except BaseException:  # noqa: BLE001 - whatever it is, the test is told
            self._failure = traceback.format_exc()

    def _do_tasks(self) -> None:
        while self._tasks:
            task, future = self._tasks.popleft()
            try:
                future.set_result(task())
            except Exception as error:  # noqa: BLE001 - whoever asked for it gets it
                future.set_exception(error)
