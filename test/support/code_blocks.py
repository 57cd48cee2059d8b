"""The code blocks of a page: what a reader copies, and what the page says is printed.

A block is run, is the output of the block before it, or carries a mark, a comment in the line
above it:

    <!-- not run: why nothing can run it here -->
    <!-- printed by: examples/demo.py -->       a transcript; the example's own test compares it
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import re

__all__ = ["ROOT", "Block", "as_pattern", "difference", "pages", "read_blocks", "transcript"]

ROOT = Path(__file__).parents[2]
RUN = {"python", "sh", "yaml", "xml"}
"""Languages of blocks that are run, or checked."""
DRAWN = "text"
"""The language of formulas and drawings."""

_FENCE = re.compile(r"^```(\S*)\n(.*?)^```$", re.M | re.S)
_MARK = re.compile(r"<!-- (not run|printed by): (.+?) -->\n\Z", re.S)
_TIME = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?(?= ?(?:ns|µs|us|ms|s|min|h|joint states)\b)")
"""Figures that vary from run to run: times, and what is counted at a fixed rate."""


@dataclass(frozen=True)
class Block:
    """A block of a page."""

    page: Path
    line: int
    """Of the fence that opens it."""
    language: str
    text: str
    mark: str = ""
    """Empty, "not run", "printed by" or, for the output of the block before it, "output"."""
    reason: str = ""

    @property
    def place(self) -> str:
        """The page and the line."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def pages() -> list[Path]:
    """Return all pages that have blocks."""
    found = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
    return [page for page in found if "\n```" in page.read_text()]


def read_blocks(page: Path) -> list[Block]:
    """Return the blocks of a page in their order."""
    text = page.read_text()
    blocks: list[Block] = []
    end = 0
    for fence in _FENCE.finditer(text):
        language, code = fence.groups()
        between, end = text[end : fence.start()], fence.end()
        mark = _MARK.search(between)
        kind, reason = (mark[1], " ".join(mark[2].split())) if mark else ("", "")
        is_output = not language and not mark and not between.strip() and blocks
        if is_output and blocks[-1].language in RUN and not blocks[-1].mark:
            kind = "output"
        line = text.count("\n", 0, fence.start()) + 1
        blocks.append(Block(page, line, language, code, kind, reason))
    return blocks


def transcript(command: str) -> str:
    """Return what the pages say a command prints."""
    blocks = [block for page in pages() for block in read_blocks(page)]
    (found,) = [b.text for b in blocks if b.mark == "printed by" and b.reason == command]
    return found


def as_pattern(documented: str) -> re.Pattern[str]:
    """Return a pattern of what may be printed: times may differ, "..." stands for anything."""
    parts = [re.escape(part) for part in _TIME.sub("<time>", documented.strip()).split("...")]
    return re.compile(".*?".join(parts), re.S)


def difference(documented: str, printed: str) -> str:
    """Say how an output differs from a page's block; nothing where it does not."""
    if as_pattern(documented).fullmatch(_TIME.sub("<time>", printed.strip())):
        return ""
    return f"the page says\n{documented}\nbut it prints\n{printed}"
