"""A page for each message, service and action: its definition, in which types are links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
import html
from pathlib import Path
import re

from tools.site.pages import Page, Section
from tools.site.places import Entry, ROOT, way

__all__ = ["INDEX", "Interface", "as_page", "entries", "page_of_interfaces", "read_interfaces"]

INDEX = Path("interfaces", "index.html")
"""Where the list of all of them is."""
_PACKAGE = "scene_graph_msgs"
_KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}
_TYPE = re.compile(r"^(\s*)([A-Z]\w*)(?=[\[\s])")
"""A type of the same package, at the beginning of a field's line."""


@dataclass(frozen=True)
class Interface:
    """A definition of the package: of a message, a service or an action."""

    name: str
    kind: str
    definition: str

    @property
    def place(self) -> Path:
        """Where on the site it is explained."""
        return Path("interfaces", self.kind, f"{self.name}.html")

    @property
    def summary(self) -> str:
        """The comment that it begins with, up to the first empty line."""
        first = re.match(r"(?:#.*\n)*", self.definition)
        return " ".join(re.sub(r"^# ?", "", first[0] if first else "", flags=re.M).split())

    @property
    def words(self) -> str:
        """What a search looks through: comments, fields and constants, without signs."""
        return " ".join(re.sub(r"#|^---$", " ", self.definition, flags=re.M).split())


def read_interfaces() -> list[Interface]:
    """Return all definitions: messages, services and actions, each by name."""
    return [
        Interface(path.stem, kind, path.read_text())
        for kind in _KINDS
        for path in sorted((ROOT / _PACKAGE / kind).glob(f"*.{kind}"))
    ]


def entries(interfaces: list[Interface]) -> list[Entry]:
    """Return what a search finds, and what pages link to."""
    return [
        Entry(each.name, each.place, each.name, f"{_PACKAGE}/{each.kind}", each.words)
        for each in interfaces
    ]


def as_page(interface: Interface, places: Mapping[str, Path]) -> Page:
    """Return the page of a definition; types among ``places`` lead to theirs."""
    link = partial(_linked, here=interface.place, places=places)
    lines = "\n".join(_line(line, link) for line in interface.definition.rstrip().splitlines())
    page = Page(interface.name)
    page.body = (
        f'<h1 id="{interface.name}">{interface.name}</h1>\n'
        f"<p><code>{_PACKAGE}/{interface.kind}/{interface.name}</code></p>\n"
        f'<pre class="pdoc-code codehilite interface">{lines}</pre>'
    )
    page.sections.append(Section(interface.name, interface.name, ""))
    return page


def _line(line: str, link: partial[str]) -> str:
    """Return a line of a definition: the type is a link, the comment is coloured."""
    code, mark, comment = line.partition("#")
    code = _TYPE.sub(lambda match: match[1] + link(match[2]), html.escape(code))
    return f'{code}<span class="c1">#{html.escape(comment)}</span>' if mark else code


def _linked(name: str, *, here: Path, places: Mapping[str, Path]) -> str:
    return f'<a href="{way(here, places[name])}">{name}</a>' if name in places else name


def page_of_interfaces(interfaces: list[Interface]) -> Page:
    """List all of them with what they are for."""
    page = Page("Messages, services and actions")
    parts = [f"<h1>{page.title}</h1>"]
    page.sections.append(Section(page.title, "", ""))
    for kind, title in _KINDS.items():
        parts.append(f'<h2 id="{kind}">{title}</h2>\n<dl>')
        page.sections.append(Section(title, kind, ""))
        for each in (each for each in interfaces if each.kind == kind):
            address, text = way(INDEX, each.place), html.escape(each.summary)
            parts.append(f'<dt><a href="{address}">{each.name}</a></dt><dd>{text}</dd>')
        parts.append("</dl>")
    page.body = "\n".join(parts)
    return page
