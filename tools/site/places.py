"""Which pages there are, and where on the site a file of ours is."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
import re

__all__ = ["ROOT", "Entry", "Target", "is_page", "order", "place", "way"]

Target = tuple[Path, str]
"""A place on the site: a file below its folder, and an anchor in it."""

ROOT = Path(__file__).resolve().parents[2]
_README = ROOT / "README.md"
_PICTURES_AND_DATA = {".png", ".csv"}


@dataclass(frozen=True)
class Entry:
    """A public name: what a search finds, and what a page may link to."""

    name: str
    place: Path
    anchor: str
    where: str
    """The module or the kind of definition."""
    summary: str


def is_page(path: Path) -> bool:
    """Tell whether a file is shown as a page."""
    return path.suffix == ".md"


def order() -> list[Path]:
    """Return all pages in the order in which README leads to them."""
    linked = re.findall(r"\]\(([\w/]+\.md)\)", _README.read_text().split("## Where to look")[1])
    pages = [_README, *(ROOT / name for name in dict.fromkeys(linked)), ROOT / "CHANGELOG.md"]
    missing = set((ROOT / "docs").glob("*.md")) - set(pages)
    if missing:
        raise SystemExit(f"README's table of pages lacks {', '.join(sorted(map(str, missing)))}")
    return pages


def place(path: Path) -> Path:
    """Return where a file of ours is, below the site's folder.

    Pages, pictures and data are at the top, whatever else a page leads to is shown below "code".
    """
    if path == _README:
        return Path("index.html")
    if is_page(path):
        return Path(f"{path.stem}.html")
    if path.suffix in _PICTURES_AND_DATA:
        return Path(path.name)
    return Path("code", f"{path.relative_to(ROOT)}.html")


def way(start: Path, end: Path) -> str:
    """Return the relative address that leads from one file of the site to another."""
    return Path(os.path.relpath(end, start.parent)).as_posix()
