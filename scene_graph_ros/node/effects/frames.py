"""A thread that makes frames of the newest snapshot, at most at a rate, as a camera does."""

from __future__ import annotations

from collections.abc import Callable
import threading
import time

from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["FrameThread", "Pace"]


class Pace:
    """When the next frame is due, and how many were missed; times are steady seconds."""

    def __init__(self, rate: float) -> None:
        """Have a frame at most every ``1 / rate`` seconds."""
        self._period = 1.0 / rate
        self._due = float("-inf")

    def wait(self, now: float) -> float:
        """Return the time (s) until the next frame is due, 0 or less if it is."""
        return self._due - now

    def take(self, now: float, offered: float) -> int:
        """Begin a frame, of which there was something to see since ``offered``.

        Return how many frames should have begun before it: whole periods since it was due.
        """
        begin = max(self._due, offered)
        missed = max(0, int((now - begin) / self._period))
        self._due = begin + (missed + 1) * self._period
        return missed


class FrameThread:
    """Makes frames one after another; snapshots that come meanwhile replace each other."""

    def __init__(self, name: str, rate: float, make: Callable[[WorldSnapshot], None]) -> None:
        """Call ``make``, which raises nothing, for the newest snapshot at most at ``rate`` Hz."""
        self._name, self._make = name, make
        self._pace = Pace(rate)
        self._changed = threading.Condition()
        self._newest: WorldSnapshot | None = None
        self._offered = 0.0
        self._thread: threading.Thread | None = None
        self._is_stopped = False
        self.late = 0

    def offer(self, snapshot: WorldSnapshot) -> None:
        """Have a frame made of a snapshot, unless a newer one comes before it is due."""
        with self._changed:
            if self._is_stopped:
                return
            if self._thread is None:
                # A daemon that is stopped at exit: a program which forgets its node can end.
                self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
                stop_at_exit(self, FrameThread.end)
                self._thread.start()
            if self._newest is None:
                self._offered = time.monotonic()
                # Otherwise the thread waits for the time, or is at a frame.
                self._changed.notify()
            self._newest = snapshot

    def stop(self) -> None:
        """End the thread after the frame that it is at; nobody waits for that."""
        with self._changed:
            self._is_stopped, self._newest = True, None
            self._changed.notify()

    def end(self) -> None:
        """End the thread, and wait for that."""
        self.stop()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        while (snapshot := self._next()) is not None:
            self._make(snapshot)
            # Not to be kept alive until the next one comes.
            del snapshot

    def _next(self) -> WorldSnapshot | None:
        """Wait for a snapshot, then until a frame is due; None at the end."""
        with self._changed:
            while not self._is_stopped:
                if self._newest is None:
                    self._changed.wait()
                    continue
                now = time.monotonic()
                wait = self._pace.wait(now)
                if wait > 0.0:
                    self._changed.wait(wait)
                    continue
                self.late += self._pace.take(now, self._offered)
                snapshot, self._newest = self._newest, None
                return snapshot
            return None
