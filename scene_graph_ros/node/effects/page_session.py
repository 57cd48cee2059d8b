"""What one page does with robots: holds a link, drags it, has a motion planned and executed.

Requests are answered in a thread of its own, which is there from when the page first holds a link
until it leaves. Of drags the newest counts.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import threading
import time
import traceback
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.page_jobs import Found, NOTHING_HELD
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.blocks import motion_block
from scene_graph_ros.views.browser.motion_requests import Drag, Hold, MotionRequest
from scene_graph_ros.views.browser.motions import MotionTold

if TYPE_CHECKING:
    from scene_graph_ros.node.effects.page_execution import PageExecution
    from scene_graph_ros.node.effects.page_work import PageWork

__all__ = ["PageSession"]

_MOST_WAITING = 8
"""Requests that wait, beside the newest drag; more are passed over."""

_PERIOD = 0.1
"""Seconds from one look at a world that moves to the next."""

_KERNELS_PERIOD = 0.5
"""Seconds from one look whether kernels are ready to the next."""


_Job = MotionRequest | Found | None
"""None: the world has moved, or kernels may be ready."""


class PageSession:
    """Takes the requests of one page; any thread may call."""

    def __init__(
        self,
        host: Host,
        execution: PageExecution | None,
        newest: Callable[[], WorldSnapshot | None],
        tell: Callable[[MotionTold], None],
    ) -> None:
        """``tell`` has the page show something, ``newest`` returns the world."""
        self._host, self._execution = host, execution
        self._newest, self._tell = newest, tell
        self._changed = threading.Condition()
        self._waiting: deque[MotionRequest | Found] = deque()
        self._drag: Drag | None = None
        self._has_moved = self._is_closed = False
        self._thread: threading.Thread | None = None
        self._looked_at = 0.0
        self.is_holding = False

    def ask(self, request: MotionRequest) -> None:
        """Take a request, unless too many wait."""
        with self._changed:
            if self._thread is None and not isinstance(request, Hold):
                self._tell(MotionTold(motion_block({"held": None, "reason": NOTHING_HELD})))
                return
            if isinstance(request, Drag):
                self._drag = request
            elif len(self._waiting) < _MOST_WAITING:
                self._waiting.append(request)
            if self._thread is None and not self._is_closed:
                self._thread = threading.Thread(target=self._run, name="page", daemon=True)
                self._thread.start()
            self._changed.notify()

    def found(self, result: Any, path: PlannedPath | None) -> None:
        """Take the end of a search."""
        with self._changed:
            self._waiting.append(Found(result, path))
            self._changed.notify()

    def follow(self) -> None:
        """Look at the world again soon."""
        with self._changed:
            if not self._has_moved:
                self._has_moved = True
                self._changed.notify()

    def close(self) -> None:
        """End after the present request; nobody waits for that."""
        with self._changed:
            self._is_closed = True
            self._waiting.clear()
            self._changed.notify()

    def end(self) -> None:
        """Do as ``close``, and wait for it."""
        self.close()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    # In its own thread.

    def _run(self) -> None:
        # Imports planning.
        from scene_graph_ros.node.effects.page_work import PageWork

        work = PageWork(self._host, self._execution, self.found, self.follow, self._tell)
        while (next_one := self._next(work)) is not None:
            self._do(work, next_one[0])
            self.is_holding = work.is_holding
            del next_one
        work.close()
        self.is_holding = False

    def _next(self, work: PageWork) -> tuple[_Job] | None:
        """Wait for the next job, alone in a tuple; None at the end."""
        with self._changed:
            while not self._is_closed:
                if self._waiting:
                    return (self._waiting.popleft(),)
                if self._drag is not None:
                    drag, self._drag = self._drag, None
                    return (drag,)
                wait = None
                if (self._has_moved and work.is_holding) or work.is_late:
                    period = _KERNELS_PERIOD if work.is_late else _PERIOD
                    wait = self._looked_at + period - time.monotonic()
                    if wait <= 0.0:
                        self._has_moved = False
                        return (None,)
                self._changed.wait(wait)
            return None

    def _do(self, work: PageWork, job: _Job) -> None:
        snapshot = self._newest()
        if snapshot is None:
            return
        self._looked_at = time.monotonic()
        try:
            work.do(job, snapshot)
        except SceneGraphError as error:
            work.refuse(str(error))
        except Exception as error:  # noqa: BLE001 - the page is told, and the node goes on
            self._host.node.get_logger().error(
                f"a page's request failed:\n{traceback.format_exc()}", throttle_duration_sec=1.0
            )
            work.refuse(f"{type(error).__name__}: {error}")
