"""A thread that computes slow answers beside the updates, which wait for a while, not for ever."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, wait
import queue
import threading
import time
from typing import Any, NamedTuple

from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["AnswerThread", "Found"]


class Found(NamedTuple):
    """An answer, and the snapshot that it is about."""

    snapshot: WorldSnapshot
    answer: Any


class _Job(NamedTuple):
    snapshot: WorldSnapshot
    future: Future[Any]
    begin: float


class AnswerThread:
    """Answers one question about snapshots, one at a time, in a thread of its own.

    While it is at one, later snapshots are passed over: the newest is taken when it is done.
    """

    def __init__(self, question: Callable[[WorldSnapshot], Any], late: Callable[[], None]) -> None:
        """Call ``late`` when an answer has come that was not waited for any longer."""
        self._question, self._late = question, late
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._job: _Job | None = None
        self._seconds = 0.0
        self.newest: Found | None = None

    def ask(self, snapshot: WorldSnapshot, seconds: float) -> Any | None:
        """Return the answer about a snapshot, None where it takes longer than some seconds.

        None at once while an earlier snapshot is being looked at. Raises the question's errors.
        """
        job = self._job
        if job is not None and not self._take(job):
            return None
        if self.newest is None or self.newest.snapshot is not snapshot:
            job = self._start(snapshot)
            if not wait([job.future], seconds).done:
                job.future.add_done_callback(lambda _: self._late())
                return None
            self._take(job)
        assert self.newest is not None
        return self.newest.answer

    def seconds(self) -> float:
        """Return the time (s) of the last answer, or of the present one up to now."""
        job = self._job
        return self._seconds if job is None else time.monotonic() - job.begin

    def close(self) -> None:
        """End the thread after its present question; nobody waits for it."""
        self._jobs.put(None)
        self._thread = None

    def _take(self, job: _Job) -> bool:
        """Take an answer that has come; tell whether it has."""
        if not job.future.done():
            return False
        self._job = None
        self.newest = Found(job.snapshot, job.future.result())
        return True

    def _start(self, snapshot: WorldSnapshot) -> _Job:
        if self._thread is None:
            # A daemon: an answer that takes long does not keep the process from its end.
            self._thread = threading.Thread(target=self._run, name="beside", daemon=True)
            self._thread.start()
        job = self._job = _Job(snapshot, Future(), time.monotonic())
        self._jobs.put(job)
        return job

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                answer = self._question(job.snapshot)
            except BaseException as error:  # noqa: BLE001 - raised again where it was asked
                job.future.set_exception(error)
            else:
                self._seconds = time.monotonic() - job.begin
                job.future.set_result(answer)
            # Not to be kept alive until the next one comes.
            del job
