"""The API reference: public modules and their docstrings, by pdoc."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
import importlib
from pathlib import Path
import pkgutil
import re
from typing import Any

import pdoc.doc
import pdoc.render

import msg_adapters
from tools.site.places import place, ROOT, Target, way
from tools.site.public import PUBLIC

__all__ = [
    "Entry",
    "entries",
    "keep_annotations",
    "modules",
    "names",
    "place_of",
    "render",
    "summary",
]

_OURS = ("scene_graph_ros.", "msg_adapters.")
"""How names of our modules begin."""


@dataclass(frozen=True)
class Entry:
    """A public name: what a search finds, and what a page may link to."""

    name: str
    place: Path
    anchor: str
    summary: str


def modules() -> dict[str, pdoc.doc.Module]:
    """Return the modules of the reference by name.

    Where a class inherits from one of ours in another module, that module is there, too, as it
    explains what is inherited.
    """
    adapters = [f"msg_adapters.{m.name}" for m in pkgutil.iter_modules(msg_adapters.__path__)]
    found: dict[str, pdoc.doc.Module] = {}
    pending = [*PUBLIC, *(name for name in adapters if name != "msg_adapters.wire")]
    while pending:
        name = pending.pop(0)
        if name not in found:
            found[name] = _module(name)
            pending += _modules_of_bases(found[name])
    return found


def _module(name: str) -> pdoc.doc.Module:
    module = importlib.import_module(name)
    # What is imported when it is first used is there from now on.
    for public in getattr(module, "__all__", ()):
        setattr(module, public, getattr(module, public))
    return pdoc.doc.Module(module)


def _modules_of_bases(module: pdoc.doc.Module) -> Iterator[str]:
    """Name the modules of ours with classes that a module's public classes inherit from."""
    for member in _public(module):
        if isinstance(member, pdoc.doc.Class):
            for base in member.obj.__mro__[1:]:
                has_public = any(not name.startswith("_") for name in vars(base))
                if has_public and base.__module__.startswith(_OURS):
                    yield base.__module__


def _public(namespace: pdoc.doc.Namespace[Any]) -> Iterator[pdoc.doc.Doc[Any]]:
    for member in namespace.members.values():
        if not member.name.startswith("_") and member.kind != "module":
            yield member


class _AsWritten(str):
    """A type as the source has it: ``NDArray[np.float64]`` says more than what it stands for."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def _as_written(annotation: Any, *_: Any) -> Any:
    annotation = getattr(annotation, "__forward_arg__", annotation)
    return _AsWritten(annotation) if isinstance(annotation, str) else annotation


def _all_as_written(annotations: dict[str, Any], *_: Any) -> dict[str, Any]:
    return {name: _as_written(annotation) for name, annotation in annotations.items()}


def keep_annotations() -> None:
    """Have pdoc show types as they are written, instead of evaluating them."""
    pdoc.doc.safe_eval_type = _as_written
    pdoc.doc.resolve_annotations = _all_as_written


def render(
    module: pdoc.doc.Module, modules: Mapping[str, pdoc.doc.Module], names: Mapping[str, Target]
) -> str:
    """Return the page of a module; public names in signatures and docstrings are links."""
    here = place_of(module.fullname)

    def link(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in names:
            return match[0]
        end, where = names[name]
        to = f"{way(here, end)}#{where}"
        return match[0].replace(name, f'<a href="{to}">{name}</a>', 1)

    def link_page(match: re.Match[str]) -> str:
        return f'<a href="{way(here, place(ROOT / match["page"]))}">{match[0]}</a>'

    text = pdoc.render.html_module(module, modules)
    text = re.sub(r'<span class="n">(?P<name>\w+)</span>', link, text)
    text = re.sub(r"<code>(?P<name>\w+)(\(\))?</code>", link, text)
    text = re.sub(r"<code>(?P<page>docs/\w+\.md)</code>", link_page, text)
    text = re.sub(
        r'(?<=<span class="annotation">)[^<]*',
        lambda types: re.sub(r"\b(?P<name>[A-Za-z]\w*)", link, types[0]),
        text,
    )
    text = re.sub(rf"\b(?:{'|'.join(_OURS)})(?:\w+\.)*(?=[A-Z])", "", text)
    return _without_links_to_what_is_not_shown(text)


def _without_links_to_what_is_not_shown(text: str) -> str:
    """Take away links within a page to names that pdoc knows but leaves out."""
    anchors = set(re.findall(r'id="([^"]+)"', text))
    return re.sub(
        r'<a [^>]*href="#([^"]+)">(.*?)</a>',
        lambda match: match[0] if match[1] in anchors else match[2],
        text,
        flags=re.DOTALL,
    )


def place_of(module: str) -> Path:
    """Return where on the site a module is explained."""
    return Path("api", f"{module.replace('.', '/')}.html")


def entries(all_modules: Iterable[pdoc.doc.Module]) -> Iterator[Entry]:
    """Yield each public name of the modules, those of classes with their class."""
    for module in all_modules:
        there = place_of(module.fullname)
        for member in _public(module):
            yield Entry(member.qualname, there, member.qualname, summary(member))
            if isinstance(member, pdoc.doc.Class):
                for own in _public(member):
                    if own in member.own_members:
                        yield Entry(own.qualname, there, own.qualname, summary(own))


def names(all_entries: Iterable[Entry]) -> dict[str, Target]:
    """Return where names are explained that stand for themselves, without a class before them."""
    result: dict[str, Target] = {}
    for entry in all_entries:
        if "." not in entry.name:
            result.setdefault(entry.name, (entry.place, entry.anchor))
    return result


def summary(doc: pdoc.doc.Doc[Any]) -> str:
    """Return the first paragraph of a docstring, in a line."""
    return " ".join(doc.docstring.partition("\n\n")[0].split())
