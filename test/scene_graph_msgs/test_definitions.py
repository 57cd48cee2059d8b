"""What all definitions have in common, read from their text: no ROS is needed for that."""

from pathlib import Path
import re

import pytest

PACKAGE = Path(__file__).parents[2] / "scene_graph_msgs"
DEFINITIONS = sorted([p for kind in ("msg", "srv", "action") for p in PACKAGE.glob(f"{kind}/*")])
SERVICES = sorted(PACKAGE.glob("srv/*.srv"))
FIELD = re.compile(r"^[A-Za-z_/0-9]+(\[[^\]]*\])?\s+[a-z][a-z0-9_]*(\s+[^=#]+)?(\s+#.*)?$")


def fields(text: str) -> list[str]:
    """Return ``<type> <name>`` of each field in a definition or half of one."""
    lines = [line for line in text.splitlines() if FIELD.match(line)]
    return [" ".join(line.split()[:2]) for line in lines]


def test_the_definitions_are_found() -> None:
    """The other tests of this file are about something."""
    assert len(DEFINITIONS) > 40
    assert sum(len(fields(path.read_text())) for path in DEFINITIONS) > 150


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_every_definition_says_what_it_is(path: Path) -> None:
    """The first line is a comment."""
    assert path.read_text().startswith("# ")


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_every_field_is_documented(path: Path) -> None:
    """A field has a comment beside it, or one above it in its paragraph."""
    text = path.read_text().replace("\n---\n", "\n\n")
    for paragraph in re.split(r"\n\s*\n", text):
        lines = paragraph.splitlines()
        first_field = next((i for i, line in enumerate(lines) if FIELD.match(line)), None)
        if first_field is None or any(line.startswith("#") for line in lines[:first_field]):
            continue
        undocumented = [line for line in lines if FIELD.match(line) and "#" not in line]
        assert not undocumented, f"{path.name}: {undocumented}"


@pytest.mark.parametrize("path", SERVICES, ids=lambda path: path.name)
def test_every_response_begins_with_a_status(path: Path) -> None:
    """Whatever is asked, the outcome is the first field of the answer."""
    _, response = path.read_text().split("\n---\n")
    assert fields(response)[0] == "Status status"


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("action/*.action")), ids=lambda p: p.name)
def test_every_result_begins_with_a_status(path: Path) -> None:
    """And says which scene it is about, as responses do."""
    _, result, _ = path.read_text().split("\n---\n")
    first, *others = fields(result)
    assert first == "Status status"
    assert {"uint64 scene_version", "builtin_interfaces/Time stamp"} <= set(others)


@pytest.mark.parametrize("path", SERVICES, ids=lambda path: path.name)
def test_every_query_says_what_it_is_about(path: Path) -> None:
    """What takes options answers with the version and the stamp it used."""
    request, response = path.read_text().split("\n---\n")
    if "QueryOptions options" in fields(request):
        assert {"uint64 scene_version", "builtin_interfaces/Time stamp"} <= set(fields(response))


@pytest.mark.parametrize(
    "name",
    [
        "AssignRole",
        "RegisterAnchoredGeometry",
        "RegisterCamera",
        "RegisterDeformableGeometry",
        "RegisterFrame",
        "RegisterGeometry",
        "RemoveCamera",
        "RemoveFrame",
        "RemoveGeometry",
        "RemoveRole",
        "RemoveSource",
        "ApplyCollisionFilter",
        "RemoveCollisionFilter",
    ],
)
def test_every_change_says_who_asks(name: str) -> None:
    """The handle of a source is the first field of each request that changes its things."""
    request, response = (PACKAGE / "srv" / f"{name}.srv").read_text().split("\n---\n")
    assert fields(request)[0] == "SourceHandle source"
    assert "uint64 scene_version" in fields(response)
