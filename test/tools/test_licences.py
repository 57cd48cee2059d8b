"""The page on licences says what the installed metadata says."""

from pathlib import Path
import re

from tools.licences import licence_of, locked_names

PAGE = Path(__file__).parents[2] / "docs" / "licences.md"


def test_the_page_is_what_is_installed():
    """Each package that is locked has its row, in order, with the licence of its metadata."""
    rows = re.findall(r"^\| ([\w.-]+) \| (.+) \|$", PAGE.read_text(), re.MULTILINE)[2:]
    assert rows == [(name, licence_of(name)) for name in locked_names()]
