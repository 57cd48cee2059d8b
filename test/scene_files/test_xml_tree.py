"""The XML reader: lines, attributes and what it refuses."""

import pytest

from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files import xml_tree
from scene_graph_ros.scene_files.xml_tree import parse_xml

TEXT = """<?xml version="1.0"?>
<!-- a comment -->
<robot name="r">
  <link name="arm">
    <collision/>
    <collision>
      <origin xyz="1 2 3"/>
    </collision>
  </link>
  <text> hello </text>
</robot>
"""


def test_elements_know_line_and_path():
    """An element is found by its line in the text and its path from the root's children."""
    root = parse_xml(TEXT, "r.urdf")
    origin = next(root.all("link")).children[1].required_child("origin")
    assert str(origin.location("xyz")) == "r.urdf:7: link['arm']/collision[1]/origin.xyz"
    assert origin.numbers("xyz", 3) == (1.0, 2.0, 3.0)
    assert root.required_child("text").text.strip() == "hello"


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("1 2", "r:1: link.xyz: expected 3 numbers, got '1 2'"),
        ("1 2 x", "r:1: link.xyz: expected a number, got 'x' in '1 2 x'"),
        ("1 nan 3", "r:1: link.xyz: must be finite, got '1 nan 3'"),
        ("1 2 inf", "r:1: link.xyz: must be finite, got '1 2 inf'"),
        (" ", "r:1: link.xyz: must not be empty, got ' '"),
    ],
)
def test_numbers_are_refused_with_place_and_value(value, message):
    """Each way to get three numbers wrong is named with its place and text."""
    root = parse_xml(f'<robot><link xyz="{value}"/></robot>', "r")
    with pytest.raises(SceneFileError) as caught:
        root.children[0].numbers("xyz", 3)
    assert str(caught.value) == message


def test_missing_attribute_and_child():
    """A missing attribute or child is named with the element it is missing from."""
    link = parse_xml("<robot>\n<link/></robot>", "r").children[0]
    with pytest.raises(SceneFileError, match=r"^r:2: link\.name: missing attribute$"):
        link.string("name")
    with pytest.raises(SceneFileError, match=r"^r:2: link: missing <geometry>$"):
        link.required_child("geometry")


def test_second_child_names_the_first():
    """Where one child is meant, another one is refused with the line of the first."""
    text = "<robot><link>\n<origin/>\n<origin xyz='1 0 0'/></link></robot>"
    link = parse_xml(text, "r").children[0]
    with pytest.raises(SceneFileError, match=r"^r:3: link/origin\[1\]: second <origin>.* line 2$"):
        link.only_child("origin")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot>\n<link></robot>", "r:2: not well-formed XML: mismatched tag"),
        ("", "not well-formed XML: no element found"),
        ("<robot/>\n<robot/>", "r:2: not well-formed XML: junk after document element"),
        (
            '<!DOCTYPE a [\n<!ENTITY x "y">]><robot>&x;</robot>',
            "r:2: entity 'x': entities are refused",
        ),
        ('<robot>\n<xacro:arm parent="a"/></robot>', "r:2: xacro:arm: is a macro; expand"),
        ("<robot \x00/>", "r:1: not well-formed XML"),
        ("\n<a>" * 60_000, "r:102: <a>: nested more than 100 deep"),
        (b"<?xml version='1.0' encoding='nosuch'?><robot/>", "r: cannot be read as XML: "),
        (b"<?xml version='1.0' encoding='utf-7'?><robot/>", "r: cannot be read as XML: "),
    ],
)
def test_what_is_no_plain_xml_is_refused(text, message):
    """Broken XML, entities and unexpanded macros are refused with their line."""
    with pytest.raises(SceneFileError) as caught:
        parse_xml(text, "r")
    assert message in str(caught.value)


def test_declared_encoding_of_bytes_is_respected():
    """A file in Latin-1 that says so is read right."""
    text = '<?xml version="1.0" encoding="ISO-8859-1"?><robot name="Grün"/>'
    assert parse_xml(text.encode("latin-1"), "r").attributes["name"] == "Grün"


def test_number_of_elements_and_size_are_limited(monkeypatch):
    """More elements, or a longer text, than a robot can have are refused."""
    monkeypatch.setattr(xml_tree, "MAX_ELEMENTS", 10)
    with pytest.raises(SceneFileError, match=r"^r:1: <a>: more than 10 elements"):
        parse_xml(f"<robot>{'<a/>' * 11}</robot>", "r")
    monkeypatch.setattr(xml_tree, "MAX_TEXT_BYTES", 50)
    with pytest.raises(SceneFileError, match=r"^r: has 68 characters, the limit is 50$"):
        parse_xml(f"<robot>{' ' * 53}</robot>", "r")


def test_text_of_many_lines_is_collected_once():
    """A megabyte of lines in one element is read in the time that its size takes."""
    text = "<robot><text>" + "line\n" * 200_000 + "</text></robot>"
    assert parse_xml(text, "r").required_child("text").text.count("line") == 200_000
