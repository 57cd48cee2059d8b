"""Write the site to build/docs: `python -m tools.site`; fails where a link leads nowhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import json
from pathlib import Path
import shutil
import sys
from typing import Any

import pdoc.render

from tools.site import reference
from tools.site.dead_links import dead_links
from tools.site.pages import Page, read_code, read_page, Section
from tools.site.places import is_page, order, place, ROOT, way

_SITE = ROOT / "build" / "docs"
_TEMPLATES = Path(__file__).with_name("templates")
_MODULES = Path("api", "index.html")


class _Menu:
    """What all pages have at their side."""

    def __init__(self, pages: Mapping[Path, Page]) -> None:
        self._titles = {place(path): page.title for path, page in pages.items()}
        self._titles[_MODULES] = "API reference"

    def at(self, here: Path) -> list[dict[str, Any]]:
        """Return its lines as they are on one page."""
        return [
            {"title": title, "address": way(here, there), "is_here": there == here}
            for there, title in self._titles.items()
        ]


def _write(path: Path, text: str) -> None:
    (_SITE / path).parent.mkdir(parents=True, exist_ok=True)
    (_SITE / path).write_text(text)


def _write_page(here: Path, page: Page, menu: _Menu) -> None:
    template = pdoc.render.env.get_template("page.html.jinja2")
    root = "../" * (len(here.parts) - 1)
    _write(here, template.render(page=page, menu=menu.at(here), root=root))


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


def _index(
    pages: Mapping[Path, Page], entries: Iterable[reference.Entry]
) -> Iterator[dict[str, str]]:
    """Yield what can be searched for."""
    for path, page in pages.items():
        for section in page.sections:
            address = f"{place(path).as_posix()}#{section.anchor}"
            where = page.title if section.title != page.title else ""
            yield {
                "title": section.title,
                "where": where,
                "text": section.text,
                "address": address,
            }
    for entry in entries:
        where = ".".join(entry.place.with_suffix("").parts[1:])
        address = f"{entry.place.as_posix()}#{entry.anchor}"
        yield {"title": entry.name, "where": where, "text": entry.summary, "address": address}


def _main() -> int:
    shutil.rmtree(_SITE, ignore_errors=True)
    pdoc.render.configure(
        docformat="google", search=False, show_source=False, template_directory=_TEMPLATES
    )
    reference.keep_annotations()
    modules = reference.modules()
    entries = list(reference.entries(modules.values()))
    names = reference.names(entries)
    pages = {path: read_page(path, names) for path in order()}
    menu = _Menu(pages)
    for path, page in pages.items():
        _write_page(place(path), page, menu)
    for path in sorted(set().union(*(page.files for page in pages.values())) - set(pages)):
        if is_page(path):
            raise SystemExit(f"{path} is led to, but not in README's table of pages")
        if place(path).suffix == ".html":
            _write_page(place(path), read_code(path), menu)
        else:
            shutil.copy(path, _SITE / place(path))
    for here, text in reference.render(modules, names).items():
        _write(here, text)
    _write_page(_MODULES, _page_of_modules(modules.values()), menu)
    index = list(_index(pages, entries))
    _write(Path("index.js"), f"const INDEX = {json.dumps(index)};\n")
    shutil.copy(_TEMPLATES / "search.js", _SITE)
    dead = dead_links(_SITE, (entry["address"] for entry in index))
    if dead:
        sys.stderr.write("Links that lead nowhere:\n" + "\n".join(dead) + "\n")
        return 1
    print(f"{len(pages)} pages and {len(modules)} modules: open {_SITE / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(_main())
