"""A page with a time line in one file, with its code and its data.

Messages are taken apart into blocks, and each block is in the file once. So a message that tells
everything, from which the page can begin anywhere, costs little beside those that tell changes.
``page/recording.js`` reads this file.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
import hashlib
from importlib import resources
import json
import re
import struct
from typing import Any
import zlib

from scene_graph_ros.views.browser.cursor import Cursor
from scene_graph_ros.views.browser.drawing import Drawing
from scene_graph_ros.views.browser.policy import hash_of, policy
from scene_graph_ros.views.browser.wishes import SHOWN_ROLES, Wish
from scene_graph_ros.views.moment import Moment

__all__ = ["MOST_BYTES", "PageFile"]

_GZIP = 16 + zlib.MAX_WBITS
_HEAD = struct.Struct("<II")
_WISH = Wish(SHOWN_ROLES, contacts=True)
"""All that the page may be asked for later, but pictures of cameras."""

_WHOLE_EVERY = 64
"""Moments: after so many, one is told as a whole, too."""

MOST_BYTES = 1 << 29
"""Of all blocks, unpacked: 512 MiB, which the page has to hold at once."""

_IMPORT = re.compile(r"^import (\{[^}]*\}) from \"\./(\w+)\.js\";$", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:class|const|function) (\w+))", re.MULTILINE)


class PageFile:
    """Takes moments one after another, and makes a page of them."""

    def __init__(self, cannot_show: Callable[[int, Exception], None]) -> None:
        """Call ``cannot_show`` with the id of a deformable geometry that can't be, and why."""
        self._drawing = Drawing(cannot_show)
        self._cursor = Cursor()
        self._numbers: dict[bytes, int] = {}
        self._begins = [0]
        self._packed: list[bytes] = []
        self._pack = zlib.compressobj(wbits=_GZIP)
        self._times: list[float] = []
        self._changes: list[list[int]] = []
        self._wholes: dict[int, list[int]] = {}

    def add(self, moment: Moment, seconds: float) -> None:
        """Show a moment at a time (s) that is not before that of the last one.

        Raises the errors of meshes and contacts.
        """
        index = len(self._times)
        self._changes.append(self._blocks(self._cursor.message(moment, _WISH, self._drawing)))
        if index % _WHOLE_EVERY == 0:
            whole = Cursor().message(moment, _WISH, self._drawing)
            self._wholes[index] = self._blocks(whole)
        self._times.append(seconds)

    def is_full(self) -> bool:
        """Tell whether it holds as much as a browser unpacks; no moment is to be added then."""
        return self._begins[-1] >= MOST_BYTES

    def most_contacts(self) -> int:
        """Return the largest number of points that touch in one moment, shown or not."""
        return self._drawing.most_contacts

    def count(self) -> int:
        """Return the number of moments."""
        return len(self._times)

    def seconds(self) -> float:
        """Return the time of the last moment after the first."""
        return self._times[-1] - self._times[0] if self._times else 0.0

    def html(self) -> str:
        """Return the page. Nothing can be added after it."""
        self._packed.append(self._pack.flush())
        content = {
            "times": [round(t - self._times[0], 6) for t in self._times],
            "changes": self._changes,
            "wholes": self._wholes,
            "begins": self._begins,
            "data": base64.b64encode(b"".join(self._packed)).decode(),
        }
        return _page(json.dumps(content, separators=(",", ":")))

    def _blocks(self, message: bytes) -> list[int]:
        """Return the numbers of a message's blocks, which are kept."""
        return [self._number(block) for block in _split(message)]

    def _number(self, block: bytes) -> int:
        key = hashlib.blake2b(block, digest_size=16).digest()
        if key not in self._numbers:
            self._numbers[key] = len(self._numbers)
            self._begins.append(self._begins[-1] + len(block))
            self._packed.append(self._pack.compress(block))
        return self._numbers[key]


def _split(message: bytes) -> Iterator[bytes]:
    begin = 0
    while begin < len(message):
        end = begin + _HEAD.size + _HEAD.unpack_from(message, begin)[1]
        yield message[begin:end]
        begin = end


def _page(content: str) -> str:
    """Return the page whose recording this JSON is."""
    folder = resources.files(__package__) / "page"

    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    html = text("index.html")
    # No text of the recording ends its element: JSON may write < otherwise.
    recording = content.replace("<", "\\u003c")
    style, program = f"\n{text('style.css')}", f"\n{_program(text)}"
    # What a header says of the live page stands in the page here: of what it is made, and no more.
    allowed = policy(hash_of(program), hash_of(style))
    charset = '<meta charset="utf-8">'
    for tag, element in (
        (charset, f'{charset}\n  <meta http-equiv="Content-Security-Policy" content="{allowed}">'),
        ('<link rel="stylesheet" href="style.css">', f"<style>{style}</style>"),
        (
            '<script type="module" src="main.js"></script>',
            f'<script type="application/json" id="recording">{recording}</script>\n'
            f'<script type="module">{program}</script>',
        ),
    ):
        before, found, after = html.partition(tag)
        assert found, f"index.html has no {tag}"
        html = before + element + after
    return html


def _program(text: Callable[[str], Any]) -> str:
    """Return all modules of the page as one, each in a scope of its own."""
    done: dict[str, str] = {}

    def add(name: str) -> None:
        if name in done:
            return
        code = text(f"{name}.js")
        for match in _IMPORT.finditer(code):
            add(match[2])
        names = ", ".join(match[1] for match in _EXPORT.finditer(code))
        code = _EXPORT.sub("", _IMPORT.sub(r"const \1 = \2Module;", code))
        done[name] = f"const {name}Module = (() => {{\n{code}\nreturn {{ {names} }};\n}})();\n"

    add("main")
    return "".join(done.values())
