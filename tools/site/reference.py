"""The API reference: public modules and their docstrings, by pdoc."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import importlib
import os
from pathlib import Path
import pkgutil
import re
import sys
from types import ModuleType
from typing import Any

import pdoc.doc
import pdoc.render

import msg_adapters
from tools.site.places import Entry, place, ROOT, Target, way
from tools.site.public import PUBLIC

__all__ = [
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


def modules() -> dict[str, pdoc.doc.Module]:
    """Return the modules of the reference by name.

    Where a class inherits from one of ours in another module, that module is there, too, as it
    explains what is inherited.
    """
    adapters = [f"msg_adapters.{m.name}" for m in pkgutil.iter_modules(msg_adapters.__path__)]
    found: dict[str, ModuleType] = {}
    pending = [*PUBLIC, *(name for name in adapters if name != "msg_adapters.wire")]
    while pending:
        name = pending.pop(0)
        if name not in found:
            found[name] = importlib.import_module(name)
            for base in _bases_of_public_classes(found[name]):
                pending.append(base.__module__)
                _show(base)
    return {name: pdoc.doc.Module(module) for name, module in found.items()}


def _bases_of_public_classes(module: ModuleType) -> Iterator[type]:
    """Yield the classes of ours that a module's public classes inherit from."""
    for name in getattr(module, "__all__", ()):
        public = getattr(module, name)
        # What is imported when it is first used is there from now on.
        setattr(module, name, public)
        if isinstance(public, type):
            yield from _bases(public)


def _show(cls: type) -> None:
    """Let pdoc take a class for public, also where it is not: it explains what is inherited."""
    names = vars(sys.modules[cls.__module__])
    if cls.__name__ not in names["__all__"]:
        names["__all__"] = [*names["__all__"], cls.__name__]


def _bases(cls: type) -> Iterator[type]:
    """Yield the classes of ours that a class inherits public members from."""
    for base in cls.__mro__[1:]:
        has_public = any(not name.startswith("_") for name in vars(base))
        if has_public and base.__module__.startswith(_OURS):
            yield base


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


def render(modules: Mapping[str, pdoc.doc.Module], names: Mapping[str, Target]) -> dict[Path, str]:
    """Return the page of each module by its place; public names in it are links."""
    pages = {}
    for name, module in modules.items():
        here = place_of(name)
        pages[here] = _with_links(pdoc.render.html_module(module, modules), here, names)
    anchors = {here: set(re.findall(r' id="([^"]+)"', text)) for here, text in pages.items()}
    return {here: _without_dead_links(text, here, anchors) for here, text in pages.items()}


def _with_links(text: str, here: Path, names: Mapping[str, Target]) -> str:
    """Turn public names in signatures and docstrings, and names of pages, into links."""

    def link(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in names:
            return match[0]
        end, where = names[name]
        to = f"{way(here, end)}#{where}"
        return match[0].replace(name, f'<a href="{to}">{name}</a>', 1)

    def link_page(match: re.Match[str]) -> str:
        return f'<a href="{way(here, place(ROOT / match["page"]))}">{match[0]}</a>'

    text = re.sub(r'<span class="n">(?P<name>\w+)</span>', link, text)
    text = re.sub(r"<code>(?P<name>\w+)(\(\))?</code>", link, text)
    text = re.sub(r"<code>(?P<page>docs/\w+\.md)</code>", link_page, text)
    text = re.sub(
        r'(?<=<span class="annotation">)[^<]*',
        lambda types: re.sub(r"\b(?P<name>[A-Za-z]\w*)", link, types[0]),
        text,
    )
    return re.sub(rf"\b(?:{'|'.join(_OURS)})(?:\w+\.)*(?=[A-Z_])", "", text)


def _without_dead_links(text: str, here: Path, anchors: Mapping[Path, set[str]]) -> str:
    """Take away the links to names that pdoc knows but does not show."""

    def keep(match: re.Match[str]) -> str:
        there = Path(os.path.normpath(here.parent / match[1])) if match[1] else here
        return match[0] if match[2] in anchors.get(there, {match[2]}) else match[3]

    return re.sub(r'<a [^>]*href="([^"#]*)#([^"]+)"[^>]*>(.*?)</a>', keep, text, flags=re.DOTALL)


def place_of(module: str) -> Path:
    """Return where on the site a module is explained."""
    return Path("api", f"{module.replace('.', '/')}.html")


def entries(all_modules: Iterable[pdoc.doc.Module]) -> Iterator[Entry]:
    """Yield each public name of the modules, those of classes with their class."""
    for module in all_modules:
        name, there = module.fullname, place_of(module.fullname)
        for member in _public(module):
            yield Entry(member.qualname, there, member.qualname, name, summary(member))
            if isinstance(member, pdoc.doc.Class):
                for own in _public(member):
                    if own in member.own_members:
                        yield Entry(own.qualname, there, own.qualname, name, summary(own))


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
