"""What `make docs` promises of pages: links lead where things are on the site, or it fails."""

from importlib.util import find_spec
from pathlib import Path
import re

import pytest

from tools.site.dead_links import dead_links
from tools.site.pages import as_page, read_code, read_page
from tools.site.places import order, place, ROOT, way
from tools.site.public import PUBLIC


def test_links_without_a_target_are_found(tmp_path):
    """Files and anchors that are not there, in the file itself and in others; not elsewhere."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a/one.html").write_text(
        '<h1 id="top"></h1><a href="#top"></a><a href="#gone"></a>'
        '<a href="../two.html#here"></a><a href="../two.html#there"></a>'
        '<img src="lost.png"><a href="https://example.org/x"></a><a href="../two.html"></a>'
    )
    (tmp_path / "two.html").write_text('<p id="here"></p><a href="a/">a folder</a>')
    assert dead_links(tmp_path, ["two.html#here", "a/one.html#found"]) == [
        "a/one.html: #gone",
        "a/one.html: ../two.html#there",
        "a/one.html: lost.png",
        "two.html: a/",
        "search: a/one.html#found",
    ]


def test_links_of_a_page_lead_to_places_on_the_site():
    """Pages and pictures are at the top, other files are shown below "code"."""
    text = "[a](node.md#topics) [b](../README.md) ![c](demo.png) [d](../setup.py) [e](#top) `Box`"
    names = {"Box": (Path("api/geometry.html"), "Box")}
    body = as_page(text, ROOT / "docs" / "page.md", names).body
    assert 'href="node.html#topics"' in body
    assert 'href="index.html"' in body
    assert 'src="demo.png"' in body
    assert 'href="code/setup.py.html"' in body
    assert 'href="#top"' in body
    assert '<a href="api/geometry.html#Box"><code>Box</code></a>' in body
    with pytest.raises(SystemExit, match=r"page.md: node.md leads to no file"):
        as_page("[a](node.md)", ROOT / "page.md", {})


def test_each_file_has_a_place_of_its_own():
    """Pages of two folders are at the top, so their names differ."""
    files = [*order(), *(ROOT / "docs").glob("*.png"), *(ROOT / "docs").glob("*.csv")]
    assert len({place(path) for path in files}) == len(files)
    assert way(Path("code/a/b.html"), Path("index.html")) == "../../index.html"


def test_no_link_of_the_pages_is_dead(tmp_path):
    """As `make docs` would find out, which writes the reference as well."""
    pages = {path: read_page(path, {}) for path in order()}
    linked = set().union(*(page.files for page in pages.values())) - set(pages)
    for path in linked:
        target = tmp_path / place(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(read_code(path).body if target.suffix == ".html" else "")
    for path, page in pages.items():
        (tmp_path / place(path)).write_text(page.body)
    assert dead_links(tmp_path) == []


def test_the_reference_has_what_pages_import():
    """Each module of the list is there, and each that an example imports from is in the list."""
    assert all(find_spec(name) for name in PUBLIC)
    text = "".join(path.read_text() for path in order())
    imported = set(re.findall(r"^from (scene_graph_ros[\w.]*) import", text, re.M))
    assert len(imported) > 3
    assert imported <= set(PUBLIC)


def test_sections_can_be_searched():
    """Each heading with its anchor and the text below it."""
    sections = {section.title: section for section in read_page(order()[0], {}).sections}
    assert sections["Two commands"].anchor == "two-commands"
    assert "make demo" in sections["Two commands"].text
