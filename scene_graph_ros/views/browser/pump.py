"""A thread that makes messages for pages: of the newest moment, at most at a rate."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import threading
import time
from typing import Any

from scene_graph_ros.views.browser.cursor import Cursor, Told
from scene_graph_ros.views.browser.drawing import Drawing
from scene_graph_ros.views.browser.motions import MotionTold
from scene_graph_ros.views.browser.wishes import Wish
from scene_graph_ros.views.moment import Moment

__all__ = ["Page", "Pump"]

_RECENT = 100
"""Messages whose times are remembered."""


class Page:
    """A page that is connected; the pump's lock guards its fields."""

    def __init__(self, deliver: Callable[[Told], None]) -> None:
        """``deliver`` sends a message and returns at once; then call ``Pump.sent``."""
        self.deliver = deliver
        self.cursor = Cursor()
        self.wish = Wish()
        self.motion = MotionTold()
        self.is_ready = True
        """Whether all that was delivered has gone out."""
        self.seen: tuple[Any, ...] | None = None
        """Of which moment, contacts and motion, and by which wish, the last message was."""


class Pump:
    """Makes the messages of all pages, one after another.

    A page gets its next message when the one before has gone out: moments that come meanwhile
    replace each other, so that a slow page sees fewer of them, and is never behind.
    """

    def __init__(
        self,
        rate: float,
        failed: Callable[[Exception], None],
        cannot_show: Callable[[int, Exception], None],
    ) -> None:
        """Make at most ``rate`` messages a second for each page.

        ``failed`` is told of an error; nothing is made then until the scene changes.
        ``cannot_show`` is told of a deformable geometry that is left out, and why.
        """
        self._period = 1.0 / rate
        self._failed = failed
        self._drawing = Drawing(cannot_show)
        self._changed = threading.Condition()
        self._pages: set[Page] = set()
        self._moment: Moment | None = None
        self._failed_version = -1
        self._due = float("-inf")
        self._is_stopped = False
        self._thread = threading.Thread(target=self._run, name="browser messages", daemon=True)
        self.messages = 0
        self.bytes = 0
        self.seconds: deque[float] = deque(maxlen=_RECENT)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread after the message that it is at; nobody waits for that."""
        with self._changed:
            self._is_stopped, self._moment = True, None
            self._changed.notify()

    def join(self) -> None:
        """Wait until it has ended, if it ever began."""
        if self._thread.ident is not None:
            self._thread.join()

    def offer(self, moment: Moment) -> None:
        """Show a moment, unless a newer one comes before a page is ready and due."""
        with self._changed:
            is_wanted = self._pages and not self._is_stopped
            if is_wanted and moment.scene_version != self._failed_version:
                self._moment = moment
                self._changed.notify()

    def count(self) -> int:
        """Return the number of pages."""
        return len(self._pages)

    def wants_contacts(self) -> bool:
        """Tell whether a page shows contacts."""
        with self._changed:
            return any(page.wish.contacts for page in self._pages)

    def is_due(self) -> bool:
        """Tell whether a page has taken its last message, and it is time for another."""
        with self._changed:
            is_time = time.monotonic() >= self._due
            return is_time and any(page.is_ready for page in self._pages)

    def add(self, page: Page) -> None:
        """Show moments to a page."""
        with self._changed:
            self._pages.add(page)
            self._changed.notify()

    def remove(self, page: Page) -> None:
        """Forget a page; without pages the moment is not kept, either."""
        with self._changed:
            self._pages.discard(page)
            if not self._pages:
                self._moment = None

    def sent(self, page: Page) -> None:
        """Tell that all that was delivered to a page has gone out."""
        with self._changed:
            page.is_ready = True
            self._changed.notify()

    def wish(self, page: Page, wish: Wish) -> None:
        """Show a page something else."""
        with self._changed:
            page.wish = wish
            self._changed.notify()

    def tell_motion(self, page: Page, told: MotionTold) -> None:
        """Show a page its robot as it drags it, and the motion that was found."""
        with self._changed:
            page.motion = told
            self._changed.notify()

    def _run(self) -> None:
        while (work := self._next()) is not None:
            moment, pages = work
            for page, wish, motion in pages:
                self._make(page, wish, motion, moment)
            # Not to be kept alive until the next one comes.
            del work, moment

    def _make(self, page: Page, wish: Wish, motion: MotionTold, moment: Moment) -> None:
        begin = time.perf_counter()
        try:
            told = page.cursor.told(moment, wish, self._drawing, motion)
        except Exception as error:  # noqa: BLE001 - it never costs anything else
            page.cursor = Cursor()
            self._failed_version = moment.scene_version
            self._failed(error)
            self.sent(page)
            return
        self.seconds.append(time.perf_counter() - begin)
        self.messages += 1
        self.bytes += sum(map(len, told.blocks))
        page.deliver(told)

    def _next(self) -> tuple[Moment, list[tuple[Page, Wish, MotionTold]]] | None:
        """Wait until a page is to be told of a moment, and it is time; None at the end."""
        with self._changed:
            while not self._is_stopped:
                moment = self._moment
                if moment is not None and moment.scene_version == self._failed_version:
                    moment = self._moment = None
                pages = [] if moment is None else [p for p in self._pages if _is_due(p, moment)]
                if moment is None or not pages:
                    self._changed.wait()
                    continue
                now = time.monotonic()
                if now < self._due:
                    self._changed.wait(self._due - now)
                    continue
                # Lateness of less than a period is made up for, so that the rate is kept.
                is_late = now - self._due > self._period
                self._due = (now if is_late else self._due) + self._period
                for page in pages:
                    page.is_ready, page.seen = False, _sight(page, moment)
                return moment, [(page, page.wish, page.motion) for page in pages]
            return None


def _sight(page: Page, moment: Moment) -> tuple[Any, ...]:
    late = moment.contact_sequence, moment.slider_sequence, moment.troubles
    # Blocks of a motion by their identity: one of the same content is the same to the page.
    return moment.sequence, *late, page.wish, *map(id, page.motion)


def _is_due(page: Page, moment: Moment) -> bool:
    return page.is_ready and page.seen != _sight(page, moment)
