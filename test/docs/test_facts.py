"""Facts of the reference's and the peers' own tests, each with the tests here that show it.

`facts.csv` has a row for each pair of a fact and a test, which this module looks up.
"""

import ast
import csv
import functools
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

with Path(__file__).with_name("facts.csv").open(newline="") as table:
    ROWS = list(csv.DictReader(table))


@functools.cache
def names_in(path):
    """Return the names of a file's tests."""
    tree = ast.parse((ROOT / path).read_text())
    return {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["test"].rpartition("::")[2])
def test_each_fact_has_a_test(row):
    """In the file that is named, and collected there."""
    path, _, name = row["test"].partition("::")
    assert row["fact"] and path.startswith("test/") and name.startswith("test_")
    assert name in names_in(path)


def test_no_row_comes_twice():
    """And the table was read."""
    pairs = [(row["fact"], row["test"]) for row in ROWS]
    assert len(pairs) == len(set(pairs)) > 80
