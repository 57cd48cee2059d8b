"""Nothing that the pages lead to is missing: links, headings, files and folders that they name."""

from fnmatch import fnmatch
from functools import cache
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
NOT_OURS = {
    ".git",
    ".venv",
    ".venv-core",
    ".venv-colcon",
    "build",
    "install",
    "log",
    "__pycache__",
}
NAMED = re.compile(r"`([\w.*<>/-]*(?:\.(?:py|md|js|srv|msg|csv)|\w/))`")
"""A file of ours or, where the last letter is a slash, a folder."""


def without_code(path):
    """Return the text of a page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", path.read_text(), flags=re.M | re.S)


@cache
def our_paths():
    """Return all files, and folders with a slash behind them, each with a slash before it."""
    found, pending = [], [ROOT]
    while pending:
        for path in pending.pop().iterdir():
            if path.name in NOT_OURS:
                continue
            found.append(f"/{path.relative_to(ROOT)}{'/' * path.is_dir()}")
            if path.is_dir():
                pending.append(path)
    return found


@cache
def anchors(path):
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", without_code(path), re.M)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(page):
    """To a file of ours, and to a heading that is in it."""
    for target in re.findall(r"\]\(([^)\s]+)\)", without_code(page)):
        if re.match(r"\w+:", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        assert path.is_relative_to(ROOT) and path.is_file(), target
        assert not anchor or anchor in anchors(path), target


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_what_is_named_is_there(page):
    """A path, or the end of one; a star or a word in angle brackets stands for anything."""
    for name in NAMED.findall(without_code(page)):
        pattern = f"*/{re.sub('<.*?>', '*', name).lstrip('/')}"
        assert any(fnmatch(path, pattern) for path in our_paths()), name


def test_every_page_can_be_found():
    """README leads to each."""
    text = (ROOT / "README.md").read_text()
    for page in (ROOT / "docs").glob("*.md"):
        assert f"](docs/{page.name})" in text, page.name
