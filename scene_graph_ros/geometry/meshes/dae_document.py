"""The elements of a COLLADA file by their names and ids, and the numbers in them."""

from __future__ import annotations

from copy import copy
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

__all__ = ["Document", "floats_of", "integers_of"]

FloatArray = NDArray[np.float64]

Element = Any
"""Of an XML tree."""


class Document:
    """A file that has passed ``check_promises``, which refuses entities and depth."""

    def __init__(self, contents: bytes) -> None:
        """Parse a file, in any namespace. Raises ElementTree.ParseError."""
        self.root: Element = ElementTree.fromstring(contents)  # noqa: S314
        self._numbers: dict[str, FloatArray] = {}
        for element in self.root.iter():
            element.tag = element.tag.rpartition("}")[2]
        self._by_id = _by_id(self.root)

    def within(self, element: Element) -> Document:
        """Return the document as it is seen from within an element.

        Of elements with one id, which some files have, that in it is meant.
        """
        seen = copy(self)
        seen._numbers = {}
        seen._by_id = {**self._by_id, **_by_id(element)}
        return seen

    def target(self, address: str | None, tag: str) -> Element:
        """Return the element of a tag that an address such as ``"#id"`` is of.

        Raises ValueError where the file has none.
        """
        found = None
        if address is not None and address.startswith("#"):
            found = self._by_id.get((tag, address[1:]))
        if found is None:
            raise ValueError(f"there is no {tag} {address!r} in the file")
        return found

    def source(self, address: str | None, names: str) -> FloatArray:
        """Return the rows (n, k) of a source, one number for each letter of ``names``.

        Its accessor's parameters tell which these are, or else their order does. Raises ValueError
        for a source that is not there, or has fewer numbers than it says.
        """
        source = self.target(address, "source")
        accessor = source.find("technique_common/accessor")
        if accessor is None:
            raise ValueError(f"the source {address!r} has no accessor")
        numbers = self._array(accessor.get("source"))
        told = [one.get("name") for one in accessor.findall("param")]
        columns = [k for k, name in enumerate(told) if name]
        if all(name in told for name in names):
            columns = [told.index(name) for name in names]
        stride = int(accessor.get("stride", max(len(told), 1)))
        start, count = int(accessor.get("offset", 0)), int(accessor.get("count", 0))
        columns = columns[: len(names)]
        if len(columns) < len(names) or max(columns) >= stride or min(start, count) < 0:
            raise ValueError(f"the source {address!r} has no {', '.join(names)}")
        if count and start + (count - 1) * stride + max(columns) >= len(numbers):
            raise ValueError(f"the source {address!r} has fewer than {count} rows of {stride}")
        rows = start + stride * np.arange(count)[:, None] + np.array(columns)
        return numbers[rows]

    def _array(self, address: str | None) -> FloatArray:
        array = self.target(address, "float_array")
        key = array.get("id")
        if key not in self._numbers:
            self._numbers[key] = floats_of(array)
        return self._numbers[key]


def _by_id(element: Element) -> dict[tuple[str, str], Element]:
    """Return an element and those in it by their tags and ids; the first of several."""
    found: dict[tuple[str, str], Element] = {}
    for one in element.iter():
        if "id" in one.attrib:
            found.setdefault((one.tag, one.get("id", "")), one)
    return found


def floats_of(element: Element) -> FloatArray:
    """Return the numbers (n,) in an element's text. Raises ValueError for what is none."""
    return np.array((element.text or "").split(), dtype=np.float64)


def integers_of(element: Element) -> NDArray[np.int64]:
    """Return the whole numbers (n,) in an element's text. Raises ValueError for what is none."""
    return np.array((element.text or "").split(), dtype=np.int64)
