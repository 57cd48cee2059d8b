"""`python -m scene_graph_ros.replay BAG`: checks, publishes, shows or repairs a recording."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
import sys

from tqdm import tqdm

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.replay.reader import Recorded, RecordingError, RecordingReader

__all__ = ["main"]

_CONTACTS = "scene_graph_msgs/msg/ContactArray"
_FPS = 30.0
_LONGEST_GAP = 86400.0
"""Seconds between two messages: a day. More is a damaged time; recordings keep a steady clock."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, 1 where contacts differ, 2 for a file that is no recording."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.fps is not None and options.html is None:
        parser.error("--fps is for --html FILE")
    try:
        reader = RecordingReader(options.bag)
        if options.repair is not None:
            return _repair(reader, options.repair)
        if options.html is not None:
            return _page(reader, options.html, options.fps or _FPS, options.quiet)
        if options.check:
            return _check(reader, options.quiet)
        return _publish(reader, options.rate, options.quiet)
    except (RecordingError, OSError) as error:
        # Some of the libraries' reasons have several lines.
        sys.stderr.write(f"replay: {' '.join(str(error).split())}\n")
    except Exception as error:  # noqa: BLE001 - bytes of others make libraries raise anything
        sys.stderr.write(
            f"replay: {options.bag} can't be read: {type(error).__name__}: {quoted(error)}; it is"
            " damaged, or another program wrote it. --repair NEW copies what is whole.\n"
        )
    return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.replay",
        description="Publish what a recorded node published, at the pace of then.",
        epilog="Exit code 1: contacts differ; 2: no recording, or one that can't be replayed.",
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder of the recording")
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--check",
        action="store_true",
        help="go through the recorded inputs again and compare all contacts bit for bit",
    )
    what.add_argument(
        "--repair",
        type=Path,
        metavar="NEW",
        help="copy what is whole of a recording that was cut off to a new folder, with an index",
    )
    what.add_argument(
        "--html",
        type=Path,
        metavar="FILE",
        help="write one page that shows the recording along a time line, in any browser",
    )
    what.add_argument(
        "--rate", type=_rate, default=1.0, help="how many times as fast as then (default: 1)"
    )
    parser.add_argument(
        "--fps", type=_rate, help=f"moments a second in the page (default: {_FPS:g})"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    return parser


def _rate(text: str) -> float:
    value = float(text)
    if not 1e-3 <= value <= 1e3:
        raise argparse.ArgumentTypeError(f"must be from 0.001 to 1000, not {text}")
    return value


def _with_progress(reader: RecordingReader, quiet: bool) -> Iterator[Recorded]:
    """Yield the messages, and say at the end where they were cut off."""
    with tqdm(total=reader.size, unit="B", unit_scale=True, disable=quiet or None) as progress:
        before = None
        for message in reader:
            _check_gap(message, before)
            before = message.time
            progress.update(reader.position - progress.n)
            yield message
        progress.update(reader.position - progress.n)
    if not reader.is_complete:
        sys.stderr.write(
            f"replay: {reader.path} was cut off; {reader.position} of {reader.size} bytes are "
            "whole. --repair makes a copy with an index.\n"
        )


def _check_gap(message: Recorded, before: int | None) -> None:
    """Raise RecordingError where nobody would wait for a message."""
    gap = 0.0 if before is None else (message.time - before) * 1e-9
    if gap > _LONGEST_GAP:
        raise RecordingError(
            f"the message on {quoted(message.topic)} comes {gap:.3g} s after the one before it,"
            f" and at most {_LONGEST_GAP:g} s are waited for: its time is damaged"
        )


def _check(reader: RecordingReader, quiet: bool) -> int:
    from scene_graph_ros.replay.contacts import ContactCheck
    from scene_graph_ros.replay.replay import Replay

    replay, check = Replay(), None
    for message in _with_progress(reader, quiet):
        if replay.take(message) or message.kind != _CONTACTS or replay.snapshot is None:
            continue
        if check is None:
            check = ContactCheck(replay.world.world_frame, replay.parameters.__getitem__)
        check.compare(replay.snapshot, replay.world.effects_off, message.time, message.data)
    _ = replay.world
    counts = (check.equal, check.late, check.different) if check else (0, 0, 0)
    sys.stdout.write(
        f"{replay.inputs} inputs, {replay.edits} edits, {replay.updates} updates; contacts: "
        f"{counts[0]} equal ({counts[1]} of them without what was late), {counts[2]} different\n"
    )
    if replay.left_out:
        sys.stdout.write(f"{replay.left_out} messages were too large to be recorded\n")
    if check is not None and check.different:
        sys.stdout.write(f"the first that differs was published at {check.first_different} ns\n")
        return 1
    return 0


def _publish(reader: RecordingReader, rate: float, quiet: bool) -> int:
    from scene_graph_ros.replay.publish import publish

    count = publish(_with_progress(reader, quiet), rate)
    sys.stdout.write(f"{count} messages published\n")
    return 0


def _page(reader: RecordingReader, path: Path, fps: float, quiet: bool) -> int:
    from scene_graph_ros.replay.page import write_page

    def warn(reason: str) -> None:
        sys.stderr.write(f"replay: {reason}\n")

    page = write_page(_with_progress(reader, quiet), path, fps, warn)
    sys.stdout.write(
        f"{page.count()} moments of {page.seconds():.1f} s in {path}, "
        f"{1e-6 * path.stat().st_size:.1f} MB\n"
    )
    return 0


def _repair(reader: RecordingReader, folder: Path) -> int:
    from scene_graph_ros.replay.repair import repair

    sys.stdout.write(f"{repair(reader, folder)} messages copied to {folder}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
