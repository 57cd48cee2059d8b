"""The examples as a newcomer finds them: an index, help for each, files only where one says."""

import argparse
from pathlib import Path
import re
import runpy
import sys

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


class _AskedError(Exception):
    """The options are known: no example is run."""


def _parser_of(example, monkeypatch) -> argparse.ArgumentParser:
    """Return what reads an example's options, as if it was started with none."""
    found = []

    def parse(parser, *_, **__):
        found.append(parser)
        raise _AskedError

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse)
    monkeypatch.setattr(argparse.ArgumentParser, "parse_known_args", parse)
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    monkeypatch.setattr(sys, "argv", [str(example)])
    with pytest.raises(_AskedError):
        runpy.run_path(str(example), run_name="__main__")
    return found[0]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_each_has_help_and_writes_where_one_is(example, monkeypatch, tmp_path):
    """What it does is said; a file that it writes is given, by default in the working folder."""
    monkeypatch.chdir(tmp_path)
    parser = _parser_of(example, monkeypatch)
    text = parser.format_help()
    assert len(text.split("\n\n")[1].split()) >= 5, text
    for action in parser._actions:
        if isinstance(action.default, Path) and not action.default.exists():
            assert not action.default.is_absolute(), action
    assert not list(tmp_path.iterdir())


def test_the_index_names_each_and_nothing_else():
    """A file that is no example lies in common/."""
    index = (ROOT / "examples" / "README.md").read_text()
    assert sorted(re.findall(r"^\| `(\w+\.py)`", index, re.MULTILINE)) == [
        p.name for p in EXAMPLES
    ]
