"""The view in a browser: of the newest snapshot, in threads of its own, for pages that are open.

Imported only where the parameter `browser` asks for it.
"""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import resource
import secrets
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.effects.moment import SnapshotMoment
from scene_graph_ros.node.effects.page_file import write_page_file
from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.server import BrowserView
from scene_graph_ros.views.browser.wishes import Move
from scene_graph_ros.views.origins import origins_of

if TYPE_CHECKING:
    from scene_graph_ros.node.effects.joint_sliders import JointSliders
    from scene_graph_ros.node.effects.page_motions import PageMotions

__all__ = ["Browser"]

_NEW = "new"
"""The token that means one which nobody knows yet."""

_MINUTE = 60.0

_MOST_STRANGERS = 8
"""Origins of pages from elsewhere that the log names; it is not theirs to fill."""


class Browser:
    """Serves the page and hands it snapshots; updates only look whether a page is open."""

    def __init__(self, host: Host) -> None:
        """Listen where parameters say; raises OSError where that can't be."""
        self._host, self._logger = host, host.node.get_logger()
        self._failure = ""
        self._unshown: set[int] = set()
        self._unseen: set[str] = set()
        self._strangers: set[str] = set()
        self._version = self._failed_version = -1
        self._joints: JointSliders | None = None
        self._motions: PageMotions | None = None
        name, port = host.parameter("browser_host"), host.parameter("browser_port")
        token = host.parameter("browser_token")
        if token == _NEW:
            token = secrets.token_urlsafe(24)
        if host.parameter("browser_control"):
            from scene_graph_ros.node.effects.joint_sliders import JointSliders
            from scene_graph_ros.node.effects.page_motions import PageMotions

            self._joints, self._motions = JointSliders(host), PageMotions(host)
        try:
            self._view = BrowserView(
                name,
                port,
                rate=host.parameter("browser_rate"),
                token=token,
                origins=origins_of(host.parameter("browser_origins")),
                channels=host.channels,
                wanted=host.request_update if host.channels is None else host.channels.wanted,
                failed=self._fail,
                cannot_show=self._cannot_show,
                refused_origin=self._refuse,
                moved=None if self._joints is None else self._move,
                motions=None if self._motions is None else self._motions.open,
                no_handles=self._say_no_handles,
            )
        except OSError as error:
            if self._motions is not None:
                self._motions.close()
            raise OSError(
                f"browser_host {name!r} and browser_port {port} can't be listened to: {error}"
            ) from error
        try:
            self._file = write_page_file(self._view.link) if token else None
        except OSError:
            self._view.end()
            raise
        self._view.start()
        # A program that forgets its node can end.
        stop_at_exit(self, Browser._end)
        told = "" if self._file is None else f", opened with its token by {self._file}"
        self._logger.info(f"browser view at {self._view.address}{told}")

    def is_heard(self) -> bool:
        """Tell whether a page shows contacts: nothing else takes long that updates wait for."""
        return self._view.wants_contacts()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: slow work is done in threads that nobody waits for."""

    def has_work(self) -> bool:
        """Tell whether a page is open."""
        return self._view.has_pages()

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to the view's thread, with the newest surfaces if they are shown."""
        if snapshot.scene_version != self._failed_version:
            self._failure = ""
        self._version = snapshot.scene_version
        if self._joints is not None:
            self._joints.publish(snapshot)
        if self._motions is not None:
            self._motions.follow(snapshot)
        found = None
        if self._view.wants_contacts():
            # Surfaces are costly: not to be found more often than they are shown.
            if not self._view.is_due():
                return
            self._host.answer("surfaces", snapshot)
            found = self._host.newest_answer("surfaces")
        scale, joints = self._host.parameter("pressure_scale"), self._joints
        troubles = self._host.troubles
        moment = SnapshotMoment(snapshot, found, scale, self._look, troubles=troubles)
        if joints is not None:
            sliders, refused = joints.sliders(snapshot), joints.refused(snapshot)
            moment = moment._replace(
                sliders=sliders, refused=refused, slider_sequence=joints.sequence
            )
        if self._motions is not None:
            moment = moment._replace(draggable=self._motions.draggable(snapshot))
        self._view.offer(moment)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: pages see that they are no longer connected."""

    def close(self) -> None:
        """Close the pages and the port."""
        self._view.stop()
        self._forget_file()
        if self._motions is not None:
            self._motions.close()
        if self._joints is not None:
            self._joints.close()

    def _end(self) -> None:
        self._view.end()
        self._forget_file()

    def _forget_file(self) -> None:
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.unlink(missing_ok=True)

    def failure(self) -> str:
        """Say why pages show nothing until the scene changes, "" while they do."""
        return self._failure

    def stale(self) -> str:
        """Return "": there is nothing it could lose."""
        return ""

    def recent_seconds(self) -> list[float]:
        """Return the times (s) that the last messages took to make."""
        return self._view.recent_seconds()

    def count(self) -> int:
        """Return the number of messages made."""
        return self._view.count()

    def counters(self) -> Mapping[str, Any]:
        """Return the address, the number of open pages, and counts of messages to them."""
        moved = {} if self._joints is None else {"joints moved": self._joints.moved}
        opened = {} if self._file is None else {"opened with its token by": str(self._file)}
        motions = {} if self._motions is None else self._motions.counters()
        return {**self._view.counters(), **opened, **moved, **motions}

    # In the view's threads.

    def _look(self, camera: str, snapshot: WorldSnapshot) -> bytes:
        if self._host.lack_of_kernels("cameras"):
            return b""
        from scene_graph_ros.node.effects.browser_pictures import color_png

        return color_png(camera, snapshot, self._cannot_look)

    def _move(self, move: Move) -> None:
        assert self._joints is not None
        self._joints.move(*move)

    def _cannot_look(self, reason: str) -> None:
        if reason not in self._unseen:
            self._unseen.add(reason)
            self._logger.warning(reason)

    def _refuse(self, origin: str) -> None:
        if origin not in self._strangers and len(self._strangers) < _MOST_STRANGERS:
            self._strangers.add(origin)
            self._logger.warning(
                f"a page of {quoted(origin)} may not read the scene; browser_origins would let it"
            )

    def _say_no_handles(self, error: OSError) -> None:
        limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        self._logger.warning(
            f"connections to the browser view wait: {error.strerror}; close some, or raise the "
            f"limit of {limit} (ulimit -n)",
            throttle_duration_sec=_MINUTE,
        )

    def _fail(self, error: Exception) -> None:
        self._failed_version = self._version
        self._failure = f"{type(error).__name__}: {error}"
        self._logger.error(f"the browser view shows nothing until the scene changes: {error}")

    def _cannot_show(self, geometry_id: int, error: Exception) -> None:
        if geometry_id not in self._unshown:
            self._unshown.add(geometry_id)
            self._logger.warning(f"geometry {geometry_id} can't be shown in a browser: {error}")
