"""Write docs/licences.md from the metadata of what is installed: `python -m tools.licences`."""

from __future__ import annotations

from importlib.metadata import distribution, PackageNotFoundError
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

__all__ = ["licence_of", "locked_names", "page"]

_ROOT = Path(__file__).resolve().parents[1]
_PAGE = _ROOT / "docs" / "licences.md"
_HEAD = """# Licences of what is installed

What `make setup` installs into `.venv`, as its metadata says; `.venv/bin/python -m tools.licences`
writes this page. None of it is part of this project, which is under the Apache License 2.0. The
engines of `make peers`, which only benchmarks use, are not listed; one of them brings Mosek, which
is not free software and is not used. uv, which installs all, is under MIT or Apache-2.0.
`make docs` adds pdoc, Jinja2, MarkupSafe, markdown2, markdown-it-py and Pygments, which are in the
public domain or under MIT and BSD licences; what it writes has style sheets of pdoc's in it.

| package | licence |
| --- | --- |
"""


def locked_names() -> list[str]:
    """Return the packages that are installed on every system."""
    text = (_ROOT / "requirements" / "locked" / "project.txt").read_text()
    return re.findall(r"^([A-Za-z0-9_.-]+)==[^ ;]+ \\$", text, re.MULTILINE)


def licence_of(name: str) -> str:
    """Return what the metadata of an installed package says; a ROS package says it elsewhere."""
    metadata = distribution(name).metadata
    for expression in metadata.get_all("License-Expression") or []:
        return str(expression)
    classifiers = [c for c in metadata.get_all("Classifier") or [] if c.startswith("License ::")]
    if classifiers:
        return ", ".join(sorted(c.rpartition(" :: ")[2] for c in classifiers))
    stated = str((metadata.get_all("License") or [""])[0]).strip()
    if stated and len(stated) <= 100 and not set(stated) & set("\n%"):  # a text, a template
        return stated
    folder = name.removeprefix("ros-").replace("-", "_")
    manifest = Path(sys.prefix, "share", folder, "package.xml")
    if name.startswith("ros-") and manifest.is_file():
        found = ElementTree.parse(manifest).getroot().findall("license")
        return ", ".join(sorted({(e.text or "").strip() for e in found}))
    return "not stated"


def page() -> str:
    """Return the page for what is installed now."""
    rows = []
    for name in locked_names():
        try:
            rows.append(f"| {name} | {licence_of(name)} |\n")
        except PackageNotFoundError as error:
            raise SystemExit(f"{name} is not installed. Remedy: make setup") from error
    return _HEAD + "".join(rows)


if __name__ == "__main__":
    _PAGE.write_text(page())
