"""The site as files: pages, a reference of modules and of definitions, and what a search reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import json
from pathlib import Path
import shutil
from typing import Any

import pdoc.doc
import pdoc.render

from tools.site import interfaces, reference
from tools.site.dead_links import dead_links
from tools.site.pages import Page, read_code, read_page, Section
from tools.site.places import Entry, is_page, order, place, way

__all__ = ["write_site"]

_TEMPLATES = Path(__file__).with_name("templates")
_MODULES = Path("api", "index.html")


class _Site:
    """The folder of the site, and what all pages have at their side."""

    def __init__(self, folder: Path, pages: Mapping[Path, Page]) -> None:
        self.folder = folder
        self._titles = {place(path): page.title for path, page in pages.items()}
        self._titles[_MODULES] = "API reference"
        self._titles[interfaces.INDEX] = "Messages, services and actions"

    def _menu(self, here: Path) -> list[dict[str, Any]]:
        """Return the lines of the menu as they are on one page."""
        return [
            {"title": title, "address": way(here, there), "is_here": there == here}
            for there, title in self._titles.items()
        ]

    def write(self, path: Path, text: str) -> None:
        """Write a file."""
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_text(text)

    def write_page(self, here: Path, page: Page) -> None:
        """Write a page with the menu at its side."""
        template = pdoc.render.env.get_template("page.html.jinja2")
        root = "../" * (len(here.parts) - 1)
        self.write(here, template.render(page=page, menu=self._menu(here), root=root))


def write_site(folder: Path, modules: Mapping[str, pdoc.doc.Module]) -> list[str]:
    """Write all files, with the reference of ``modules``; return the links that lead nowhere."""
    pdoc.render.configure(
        docformat="google", search=False, show_source=False, template_directory=_TEMPLATES
    )
    definitions = interfaces.read_interfaces()
    entries = [*reference.entries(modules.values()), *interfaces.entries(definitions)]
    names = reference.names(entries)
    pages = {path: read_page(path, names) for path in order()}
    site = _Site(folder, pages)
    _write_pages(site, pages)
    for here, text in reference.render(modules, names).items():
        site.write(here, text)
    site.write_page(_MODULES, _page_of_modules(modules.values()))
    _write_interfaces(site, definitions)
    index = list(_index(pages, entries))
    site.write(Path("index.js"), f"const INDEX = {json.dumps(index)};\n")
    shutil.copy(_TEMPLATES / "search.js", folder)
    return dead_links(folder, (entry["address"] for entry in index))


def _write_pages(site: _Site, pages: Mapping[Path, Page]) -> None:
    """Write the pages in Markdown, and the files of ours that they lead to."""
    for path, page in pages.items():
        site.write_page(place(path), page)
    for path in sorted(set().union(*(page.files for page in pages.values())) - set(pages)):
        if is_page(path):
            raise SystemExit(f"{path} is led to, but not in README's table of pages")
        if place(path).suffix == ".html":
            site.write_page(place(path), read_code(path))
        else:
            shutil.copy(path, site.folder / place(path))


def _write_interfaces(site: _Site, definitions: list[interfaces.Interface]) -> None:
    """Write the page of each definition, and the list of all."""
    places = {each.name: each.place for each in definitions}
    for each in definitions:
        site.write_page(each.place, interfaces.as_page(each, places))
    site.write_page(interfaces.INDEX, interfaces.page_of_interfaces(definitions))


def _page_of_modules(modules: Iterable[Any]) -> Page:
    """List the modules with what they are for."""
    page = Page("API reference")
    rows = []
    for module in modules:
        address = way(_MODULES, reference.place_of(module.fullname))
        text = pdoc.render_helpers.to_html(reference.summary(module))
        rows.append(f'<dt><a href="{address}">{module.fullname}</a></dt><dd>{text}</dd>')
    page.body = f"<h1>{page.title}</h1>\n<dl>{''.join(rows)}</dl>"
    page.sections.append(Section(page.title, "", ""))
    return page


def _index(pages: Mapping[Path, Page], entries: Iterable[Entry]) -> Iterator[dict[str, str]]:
    """Yield what can be searched for."""
    for path, page in pages.items():
        for section in page.sections:
            yield {
                "title": section.title,
                "where": page.title if section.title != page.title else "",
                "text": section.text,
                "address": f"{place(path).as_posix()}#{section.anchor}",
            }
    for entry in entries:
        yield {
            "title": entry.name,
            "where": entry.where,
            "text": entry.summary,
            "address": f"{entry.place.as_posix()}#{entry.anchor}",
        }
