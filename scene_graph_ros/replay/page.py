"""A recording as one page with a time line, to be looked at without anything else."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.effects.moment import SnapshotMoment
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.replay.contacts import answer_of, effects_on, SURFACES
from scene_graph_ros.replay.reader import Recorded, RecordingError
from scene_graph_ros.replay.replay import Replay
from scene_graph_ros.views.browser.drawing import MOST_CONTACTS
from scene_graph_ros.views.browser.page_file import MOST_BYTES, PageFile

__all__ = ["write_page"]


def write_page(
    messages: Iterable[Recorded], path: Path, fps: float, warn: Callable[[str], None]
) -> PageFile:
    """Replay messages and write the world's states, at most ``fps`` a second, to ``path``.

    Raises RecordingError where that can't be, and OSError where there is such a file already or
    none can be written; then there is none. ``warn`` is told of parts that are left out.
    """
    page = PageFile(lambda id_, error: warn(f"geometry {id_} is left out: {error}"))
    with path.open("x", encoding="utf-8") as file:
        try:
            _show(messages, page, round(1e9 / fps), warn)
            file.write(page.html())
        except BaseException:
            path.unlink()
            raise
    return page


def _show(
    messages: Iterable[Recorded], page: PageFile, period: int, warn: Callable[[str], None]
) -> None:
    """Add moments that are ``period`` ns apart, the last one before each pause, and the last."""
    replay = Replay()
    snapshot, passed, due = None, None, 0

    def add(shown: WorldSnapshot, time: int) -> None:
        page.add(_moment(replay, shown), 1e-9 * time)

    for message in messages:
        if page.is_full():
            warn(
                f"the page ends after {page.seconds():.1f} s, as it has {MOST_BYTES >> 20} MiB:"
                " more fits in with a lower --fps"
            )
            passed = None
            break
        replay.take(message)
        if replay.snapshot is None or replay.snapshot is snapshot:
            continue
        snapshot = replay.snapshot
        if passed is not None and message.time - passed[1] > period:
            add(*passed)
            passed = None
        if message.time >= due:
            add(snapshot, message.time)
            passed, due = None, message.time + period
        else:
            passed = (snapshot, message.time)
    if passed is not None:
        add(*passed)
    if page.most_contacts() > MOST_CONTACTS:
        warn(f"of {page.most_contacts()} contacts at once the {MOST_CONTACTS} deepest are shown")
    if page.count() == 0:
        raise RecordingError("the recording has no update of the world, so nothing can be shown")


def _moment(replay: Replay, snapshot: WorldSnapshot) -> SnapshotMoment:
    on = effects_on(snapshot, replay.world.effects_off, replay.parameters.__getitem__)
    answer = answer_of(on, SURFACES, snapshot)
    found = None if answer is None else Found(snapshot, answer)
    return SnapshotMoment(snapshot, found, replay.parameters["pressure_scale"])
