"""The motions of robots that pages ask for, as the server of the view sees them."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from scene_graph_ros.views.browser.motion_requests import MotionRequest

__all__ = ["MotionTold", "PageMotion"]


class MotionTold(NamedTuple):
    """Blocks for one page, each empty before there is something to tell."""

    held: bytes = b""
    """The robot as the page drags it, and the state of its requests."""
    planned: bytes = b""
    """The motion that was found last."""


class PageMotion(Protocol):
    """One page's session with robots. Its methods return at once, in any thread."""

    def ask(self, request: MotionRequest) -> None:
        """Take a request; the answer comes as another `MotionTold`."""

    def close(self) -> None:
        """End, and everything that the page asked for with it, but motions that are executed."""
