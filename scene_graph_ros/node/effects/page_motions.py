"""Motions of robots that pages ask for: one session a page. Imports no planning.

Imported only where the parameter `browser_control` asks for it; planning comes when a page first
holds a link.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any, TYPE_CHECKING
import weakref

from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.page_session import PageSession
from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.motions import MotionTold, PageMotion
from scene_graph_ros.views.draggable import DraggableRobot

if TYPE_CHECKING:
    from scene_graph_ros.node.effects.page_execution import PageExecution

__all__ = ["PageMotions"]


class PageMotions:
    """The sessions of all pages."""

    def __init__(self, host: Host) -> None:
        """Advertise the topic of executed motions, where `browser_execute` asks for it."""
        self._host = host
        self._lock = threading.Lock()
        self._sessions: weakref.WeakSet[PageSession] = weakref.WeakSet()
        self._snapshot: WorldSnapshot | None = None
        self._draggable: tuple[int, tuple[DraggableRobot, ...]] = (-1, ())
        self._is_closed = False
        self._execution: PageExecution | None = None
        if host.parameter("browser_execute"):
            from scene_graph_ros.node.effects.page_execution import PageExecution

            self._execution = PageExecution(host)
        stop_at_exit(self, PageMotions._end)

    def draggable(self, snapshot: WorldSnapshot) -> tuple[DraggableRobot, ...]:
        """Return the robots whose links may be dragged; the same while the scene is the same."""
        if self._draggable[0] != snapshot.scene_version:
            found = (
                DraggableRobot(name, _carried_links(loaded), self._execution is not None)
                for name, loaded in sorted(snapshot.robots.robots.items())
            )
            robots = tuple(each for each in found if each.links)
            self._draggable = (snapshot.scene_version, robots)
        return self._draggable[1]

    def open(self, tell: Callable[[MotionTold], None]) -> PageMotion:
        """Return a page's session, which gives it blocks to show; in any thread."""
        with self._lock:
            session = PageSession(self._host, self._execution, lambda: self._snapshot, tell)
            self._sessions.add(session)
        if self._is_closed:
            session.close()
        return session

    def follow(self, snapshot: WorldSnapshot) -> None:
        """Have the sessions see a moment; returns at once."""
        self._snapshot = snapshot
        for session in self._all():
            session.follow()

    def close(self) -> None:
        """End all sessions, after the request that each is at, and advertise nothing."""
        self._is_closed = True
        self._end()
        if self._execution is not None:
            self._execution.close()

    def counters(self) -> dict[str, Any]:
        """Return counts of sessions and motions."""
        sessions = self._all()
        counts = {"pages that hold a link": sum(each.is_holding for each in sessions)}
        if self._execution is not None:
            counts["motions executed"] = self._execution.count
        return counts

    def _all(self) -> list[PageSession]:
        with self._lock:
            return list(self._sessions)

    def _end(self) -> None:
        for session in self._all():
            session.end()


def _carried_links(loaded: Any) -> tuple[str, ...]:
    """Return the names of a robot's links that a joint carries, from the base outwards."""
    model = loaded.kinematics.robot
    fixed = model.fixed_to_root()
    return tuple(link for link in model.links if link not in fixed)
