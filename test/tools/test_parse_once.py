"""Generators that share what was parsed: the same interfaces as without, parsed once."""

import importlib.util
from pathlib import Path
import subprocess
import sys

import pytest

parser = pytest.importorskip("rosidl_parser.parser")
SOURCE = Path(__file__).parents[2] / "scene_graph_msgs" / "cmake" / "parse_once.py"
IDL = "module a { module msg { struct B { double x; }; }; };\n"


@pytest.fixture
def parse_once(monkeypatch):
    """The function, with a parser that counts; the parser is as before at the end."""
    spec = importlib.util.spec_from_file_location("parse_once", SOURCE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    parse, calls = parser.parse_idl_string, []

    def counting(text, png_file=None):
        calls.append(text)
        return parse(text, png_file)

    def start(folder):
        monkeypatch.setattr(parser, "parse_idl_string", counting)
        module.parse_once(folder)
        return calls

    return start


def test_an_interface_is_parsed_once(parse_once, tmp_path):
    """The next generator reads what the first one kept; another text is parsed."""
    calls = parse_once(tmp_path)
    first = parser.parse_idl_string(IDL)
    parse_once(tmp_path)  # as another process would
    second = parser.parse_idl_string(IDL)
    assert len(calls) == 1
    structures = [content.elements[0].structure for content in (first, second)]
    assert [s.namespaced_type.name for s in structures] == ["B", "B"]
    assert [[m.name for m in s.members] for s in structures] == [["x"], ["x"]]
    parser.parse_idl_string(IDL.replace("double", "float"))
    assert len(calls) == 2


def test_other_commands_run_as_they_are(tmp_path):
    """What is no generator is started in the same process, with its exit code."""
    command = [sys.executable, "-c", "raise SystemExit(3)"]
    done = subprocess.run([sys.executable, SOURCE, tmp_path, *command], check=False)
    assert done.returncode == 3
