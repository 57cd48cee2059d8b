"""A small XML tree: elements know their line, and say where an attribute is wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
import math
from xml.parsers import expat

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import Location, SceneFileError

__all__ = ["XmlElement", "parse_xml"]


MAX_DEPTH = 100
"""How deep elements may be in each other. URDF has about six levels."""

_BLANKS = " \t\r\n\0\ufeff"

MAX_ELEMENTS = 1_000_000
"""They take some 400 bytes each."""


@dataclass(slots=True)
class XmlElement:
    """An element of a parsed file."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    parent: XmlElement | None = None
    position: int = 0
    """How many children of this tag the parent has before."""
    children: list[XmlElement] = field(default_factory=list)
    text: str = ""
    remarks: list[str] = field(default_factory=list)
    """What was noticed while the tree was read, the same list for all of it."""

    @property
    def path(self) -> str:
        """Name the element as ``link['arm']/collision[1]/geometry``; the root has no name."""
        labels: list[str] = []
        element = self
        while element.parent is not None:
            labels.append(element._label())
            element = element.parent
        return "/".join(reversed(labels))

    def _label(self) -> str:
        if self.attributes.get("name"):
            return f"{self.tag}[{quoted(self.attributes['name'])}]"
        return self.tag if self.position == 0 else f"{self.tag}[{self.position}]"

    def all(self, tag: str) -> Iterator[XmlElement]:
        """Yield the direct children called ``tag``."""
        return (child for child in self.children if child.tag == tag)

    def child(self, tag: str) -> XmlElement | None:
        """Return the first direct child called ``tag``, if there is one."""
        return next(self.all(tag), None)

    def only_child(self, tag: str) -> XmlElement | None:
        """Return the child called ``tag``, if there is one.

        Of several that say the same the first counts, with a remark; others are refused.
        """
        found = list(self.all(tag))
        for other in found[1:]:
            what = f"second <{tag}>, the first is in line {found[0].line}"
            if not found[0].says_as(other):
                raise other.error(what)
            remark = f"{other.location()}: {what}, and says the same"
            if remark not in self.remarks:
                self.remarks.append(remark)
        return found[0] if found else None

    def says_as(self, other: XmlElement) -> bool:
        """Tell whether another element has the same tag, attributes, text and children."""
        own, its = ((e.tag, e.attributes, e.text.split()) for e in (self, other))
        if own != its or len(self.children) != len(other.children):
            return False
        pairs = zip(self.children, other.children, strict=True)
        return all(mine.says_as(their) for mine, their in pairs)

    def required_child(self, tag: str) -> XmlElement:
        """Return the one child called ``tag``; raise if it is missing or there are several."""
        child = self.only_child(tag)
        if child is None:
            raise self.error(f"missing <{tag}>")
        return child

    def location(self, attribute: str = "") -> Location:
        """Return the location of this element, or of one of its attributes."""
        path = f"{self.path}.{attribute}" if attribute else self.path
        return Location(self.file, self.line, path)

    def error(self, message: str, attribute: str = "") -> SceneFileError:
        """Return an error that names file, line, element and attribute."""
        return SceneFileError(f"{self.location(attribute)}: {message}")

    def string(self, name: str, default: str | None = None) -> str:
        """Return an attribute that may not be empty; raise if it is missing without default."""
        value = self.attributes.get(name, default)
        if value is None:
            raise self.error("missing attribute", name)
        if not value.strip():
            raise self.error(f"must not be empty, got {quoted(value)}", name)
        if "${" in value or "$(" in value:
            text = f"{quoted(value)} is for xacro; expand the file with xacro first"
            raise self.error(text, name)
        return value.strip()

    def name(self, attribute: str) -> str:
        """Return an attribute that names something, without the slash that it begins with."""
        name = self.string(attribute).removeprefix("/")
        if not name:
            raise self.error("must not be empty, got '/'", attribute)
        return name

    def numbers(self, name: str, count: int, default: str | None = None) -> tuple[float, ...]:
        """Return an attribute that holds ``count`` finite numbers parted by blanks."""
        text = self.string(name, default)
        parts = text.split()
        if len(parts) != count:
            noun = "number" if count == 1 else "numbers"
            raise self.error(f"expected {count} {noun}, got {quoted(text)}", name)
        values = []
        for part in parts:
            try:
                # Python takes 1_0 for ten.
                value = float(part.replace("_", "?"))
            except ValueError:
                raise self.error(
                    f"expected a number, got {quoted(part)} in {quoted(text)}", name
                ) from None
            if not math.isfinite(value):
                raise self.error(f"must be finite, got {quoted(text)}", name)
            values.append(value)
        return tuple(values)

    def number(self, name: str, default: str | None = None) -> float:
        """Return an attribute that holds one finite number."""
        return self.numbers(name, 1, default)[0]

    def positive(self, name: str) -> float:
        """Return an attribute that holds one number greater than zero."""
        value = self.number(name)
        if not value > 0.0:
            raise self.error(f"must be positive, got {value:g}", name)
        return value


class _TreeBuilder:
    """Collects the events of expat into a tree."""

    def __init__(self, file: str, lines_before: int) -> None:
        self.file = file
        self.lines_before = lines_before
        self.root: XmlElement | None = None
        self.open: list[XmlElement] = []
        self.counts: list[dict[str, int]] = []
        self.texts: list[list[str]] = []
        self.total = 0
        self.remarks: list[str] = []
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters
        self.parser.EntityDeclHandler = self.entity

    @property
    def line(self) -> int:
        """The line of the file that is being read."""
        return self.lines_before + int(self.parser.CurrentLineNumber)

    def fail(self, message: str) -> SceneFileError:
        place = Location(self.file, self.line)
        return SceneFileError(f"{place}: {message}")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag.startswith("xacro:"):
            raise self.fail(f"{tag}: is a macro; expand the file with xacro first")
        self.total += 1
        if self.total > MAX_ELEMENTS:
            raise self.fail(f"<{tag}>: more than {MAX_ELEMENTS} elements")
        if len(self.open) >= MAX_DEPTH:
            raise self.fail(f"<{tag}>: nested more than {MAX_DEPTH} deep")
        self._open(XmlElement(tag, attributes, self.file, self.line, remarks=self.remarks))

    def _open(self, element: XmlElement) -> None:
        if self.open:
            element.parent = self.open[-1]
            element.position = self.counts[-1].get(element.tag, 0)
            self.counts[-1][element.tag] = element.position + 1
            element.parent.children.append(element)
        else:
            self.root = element
        self.open.append(element)
        self.counts.append({})
        self.texts.append([])

    def end(self, _tag: str) -> None:
        self.counts.pop()
        self.open.pop().text = "".join(self.texts.pop())

    def characters(self, text: str) -> None:
        if self.texts:
            self.texts[-1].append(text)

    def entity(self, name: str, *_details: object) -> None:
        raise self.fail(f"entity {quoted(name)}: entities are refused")


def _without_fringe(source: str | bytes) -> tuple[str | bytes, int]:
    """Return a text without blanks before it and NULs behind it, and the lines before it.

    Templates leave blank lines before the declaration, programs in C the end of their string.
    """
    if isinstance(source, str):
        text = source.lstrip(_BLANKS)
        return text.rstrip(_BLANKS), source[: len(source) - len(text)].count("\n")
    if source.startswith((b"\xff\xfe", b"\xfe\xff")):
        return source, 0  # UTF-16, in which a NUL is half of a letter
    blanks = b" \t\r\n\0"
    data = source.lstrip(blanks)
    return data.rstrip(blanks), source[: len(source) - len(data)].count(b"\n")


def parse_xml(source: str | bytes, file: str) -> XmlElement:
    """Return the root element of an XML text; ``file`` is its name in messages.

    Raises SceneFileError, with the line, for text that is not well-formed XML, declares entities,
    still contains xacro macros, or is beyond MAX_DEPTH, MAX_ELEMENTS or MAX_TEXT_BYTES.
    """
    if len(source) > MAX_TEXT_BYTES:
        raise SceneFileError(
            f"{file}: has {len(source)} characters, the limit is {MAX_TEXT_BYTES}"
        )
    text, lines_before = _without_fringe(source)
    builder = _TreeBuilder(file, lines_before)
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        where = Location(file, lines_before + error.lineno)
        raise SceneFileError(f"{where}: not well-formed XML: {reason}") from error
    except SceneFileError:
        raise
    except (ValueError, LookupError) as error:  # LookupError: an encoding that there is not
        raise SceneFileError(f"{file}: cannot be read as XML: {error}") from error
    if builder.root is None:
        raise SceneFileError(f"{file}: no XML element")
    return builder.root
