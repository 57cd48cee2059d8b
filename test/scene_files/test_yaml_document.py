"""The YAML reader: values, lines, and what it refuses."""

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
import yaml

from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files import yaml_document
from scene_graph_ros.scene_files.yaml_document import parse_yaml, path_text


def error_of(text):
    """Return the message with which a YAML text is refused."""
    with pytest.raises(SceneFileError) as caught:
        parse_yaml(text, "f")
    return str(caught.value)


def test_lines_of_values():
    """Each value has the line of its key, or of its dash in a list."""
    text = "a: 1\nb:\n  - x\n  - c: 2\n    d:\n      [3,\n       4]\n"
    document = parse_yaml(text, "f")
    assert document.data == {"a": 1, "b": ["x", {"c": 2, "d": [3, 4]}]}
    lines = {
        ("a",): 1,
        ("b",): 2,
        ("b", 0): 3,
        ("b", 1, "d"): 5,
        ("b", 1, "d", 1): 7,
        ("b", 1, "missing"): 4,  # the nearest thing around it
    }
    assert {path: document.location(*path).line for path in lines} == lines
    assert str(document.error("no", "b", 1, "d")) == "f:5: b[1].d: no"


def test_scalars_follow_yaml_1_2():
    """Words that YAML 1.1 takes for booleans, octals, times or dates are what they look like."""
    text = "[off, yes, 1e-3, 010, 12:30, 2026-01-01, -1.5, .5, true, null, ~, .inf, 0x1F, '1']"
    expected = ["off", "yes", 0.001, 10, "12:30", "2026-01-01", -1.5, 0.5, True, None, None]
    assert parse_yaml(text, "f").data == [*expected, float("inf"), "0x1F", "1"]


def test_aliases_and_merge_keys():
    """A value can be used again, and a mapping extended; own keys win over merged ones."""
    text = "base: &b {x: 1, y: 2}\nsame: *b\nmore:\n  <<: *b\n  y: 3\n"
    data = parse_yaml(text, "f").data
    assert data["same"] == {"x": 1, "y": 2}
    assert data["more"] == {"x": 1, "y": 3}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: {\n", "f:3: not YAML: "),
        ("a: 1\n b: 2\n", "f:2: not YAML: mapping values are not allowed here"),
        ("a: 1\na: 2\n", "f:2: a: given twice, first in line 1"),
        ("b:\n  - {c: 1, d: 2, c: 3}\n", "f:2: b[0].c: given twice, first in line 2"),
        ("a: 1\n3: 2\n", "f:2: keys must be text, got '3'"),
        ("a: 1\n[x]: 2\n", "f:2: keys must be text"),
        ("a: !!python/name:os.system x", "f:1: a: the tag 'tag:yaml.org,2002:python/name:"),
        ("a: !thing x", "f:1: a: the tag '!thing' is refused"),
        ("a: *b", "f:1: not YAML: found undefined alias 'b'"),
        ("a: &b [*b]", "f:1: a[0]: an alias contains itself"),
        ("a: 1\n---\nb: 2", "f:2: not YAML: but found another document"),
        (b"a: \xff\xfe", "f: not YAML: "),
    ],
)
def test_what_is_refused(text, message):
    """Broken YAML, double keys, tags and endless aliases are refused with their line."""
    assert error_of(text).startswith(message)


def test_aliases_that_multiply_are_refused(monkeypatch):
    """Nine levels of nine aliases would be 9^9 values."""
    monkeypatch.setattr(yaml_document, "MAX_VALUES", 10_000)
    levels = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 10)]
    assert "more than 10000 values" in error_of("\n".join(["a0: &a0 x", *levels]))


def test_merge_keys_do_not_multiply():
    """Ten levels that merge the one before ten times have the keys that there are."""
    levels = [
        f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}], k{i}: {i}}}" for i in range(1, 11)
    ]
    data = parse_yaml("\n".join(["a0: &a0 {k0: 0}", *levels]), "f").data
    assert data["a10"] == {f"k{i}": i for i in range(11)}


def test_merging_more_than_there_may_be_is_refused(monkeypatch):
    """Two thousand mappings that merge a hundred keys each look at two hundred thousand."""
    monkeypatch.setattr(yaml_document, "MAX_VALUES", 20_000)
    base = ", ".join(f"k{i}: 0" for i in range(100))
    text = f"a: &a {{{base}}}\nb: {{<<: [{', '.join(['*a'] * 2000)}]}}"
    assert error_of(text).startswith("f:2: b: more than 20000 values, with those merged")


def test_of_merged_mappings_the_first_wins():
    """An own key wins over merged ones, a mapping over those after it in the list."""
    text = "a: &a {x: 1, y: 1, z: 1}\nb: &b {x: 2, y: 2, w: 2}\nc: {<<: [*a, *b], x: 3}"
    assert parse_yaml(text, "f").data["c"] == {"x": 3, "y": 1, "z": 1, "w": 2}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a:\n " + "[" * 2000, "f:2: not YAML: nested more than 100 deep"),
        ("a: " + "{b: " * 101, "f:1: not YAML: nested more than 100 deep"),
        (
            "\n".join(["a: &a0 []", *(f"b{i}: &a{i} [*a{i - 1}]" for i in range(1, 200))]),
            "100 deep",
        ),
        (
            "<<:\n- k: [&a0 {}"
            + "".join(f", &a{i} {{<<: *a{i - 1}}}" for i in range(1, 3000))
            + "]\n- {<<: *a2999}",
            "f:2: merges more than 100 deep",
        ),
        ("a: {<<: &m {<<: *m}}", "an alias contains itself"),
        ("a: {<<: [1]}", "f:1: a: << takes a mapping or a list of mappings"),
        ("a: {<<: {[x]: 2}}", "keys must be text"),
        ("a: " + "1" * 5000, "f:1: a: Exceeds the limit"),
    ],
)
def test_depth_is_limited(text, message):
    """What is nested too deep, also by aliases and merge keys, is refused with its line."""
    assert message in error_of(text)


def test_number_of_nodes_is_limited_while_reading(monkeypatch):
    """A long list is refused before the rest of it is read."""
    monkeypatch.setattr(yaml_document, "MAX_VALUES", 1000)
    assert error_of("\n".join(["- 1"] * 2000 + ["{"])) == "f:1000: not YAML: more than 1000 values"


def test_size_of_text_is_limited(monkeypatch):
    """A text that is too long is not even looked at."""
    monkeypatch.setattr(yaml_document, "MAX_TEXT_BYTES", 100)
    assert error_of("{" * 101) == "f: has 101 characters, the limit is 100"


def test_paths_are_written_as_in_code():
    """Indices are in brackets, keys behind dots."""
    assert path_text(("geometries", 3, "shape", "radius")) == "geometries[3].shape.radius"
    assert path_text(()) == ""


scalars = st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.floats(allow_nan=False)
values = st.recursive(
    scalars | st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z"))),
    lambda v: st.lists(v, max_size=3) | st.dictionaries(st.text("abcdef", min_size=1), v),
    max_leaves=12,
)


@settings(deadline=None)
@given(values)
def test_what_a_writer_writes_is_read_back(value):
    """Any value of plain types survives being written and read."""

    class Writer(yaml.SafeDumper):
        """Quotes every text, as YAML 1.1 and 1.2 differ in which text needs it."""

    Writer.add_representer(
        str, lambda w, text: w.represent_scalar("tag:yaml.org,2002:str", text, style='"')
    )
    assert parse_yaml(yaml.dump(value, Dumper=Writer, allow_unicode=True), "f").data == value
