"""Links of a site that lead nowhere."""

from __future__ import annotations

from collections.abc import Iterable
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

__all__ = ["dead_links"]


class _Reader(HTMLParser):
    """Collects where one can go in a file, and where one can go from it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Read one element."""
        for name, value in attrs:
            if name == "id":
                self.anchors.add(value or "")
            elif name in {"href", "src"}:
                self.links.append(value or "")


def dead_links(folder: Path, searched: Iterable[str] = ()) -> list[str]:
    """Return "file: link" for each link in the folder to a file or an anchor that is not there.

    ``searched`` are addresses, relative to the folder, that a search leads to. Links to elsewhere
    (with a scheme, such as https) are not looked at.
    """
    pages = {path: _Reader(path.read_text()) for path in sorted(folder.rglob("*.html"))}
    links = [(path, link) for path, page in pages.items() for link in page.links]
    links += [(folder / "search", address) for address in searched]
    return [
        f"{path.relative_to(folder)}: {link}"
        for path, link in links
        if not _is_alive(link, path, pages)
    ]


def _is_alive(link: str, path: Path, pages: dict[Path, _Reader]) -> bool:
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return True
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not parts.fragment:
        return target.is_file()
    return target in pages and unquote(parts.fragment) in pages[target].anchors
