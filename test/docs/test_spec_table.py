"""Each name of the reference is a name here, which is imported, or a decision on the page."""

import csv
import dataclasses
import importlib
import inspect
from pathlib import Path
import re
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
NAMES = Path(__file__).with_name("spec_names.txt").read_text().split()
PAGE = (ROOT / "docs" / "spec.md").read_text()
DECISION = "decision:"

with (ROOT / "docs" / "spec.csv").open(newline="") as table:
    ROWS = list(csv.DictReader(table))


def module_of(path: str) -> tuple[Any, list[str]]:
    """Return the module that a dotted path begins with, and the names that are left."""
    parts = path.split(".")
    for count in range(len(parts), 0, -1):
        try:
            return importlib.import_module(".".join(parts[:count])), parts[count:]
        except ModuleNotFoundError:
            continue
    raise LookupError(path)


def member(owner: Any, name: str) -> Any:
    """Return an attribute; of a class also what its instances have. Raises LookupError."""
    found = getattr(owner, name, LookupError)
    if found is not LookupError:
        return found
    if inspect.isclass(owner):
        fields = {field.name for field in getattr(owner, "__dataclass_fields__", {}).values()}
        slots = {slot for each in owner.__mro__ for slot in getattr(each, "__slots__", ())}
        if name in fields | slots:
            return None
    raise LookupError(f"{owner} has no {name}")


def resolve(path: str) -> None:
    """Raise LookupError where a path names nothing."""
    path, _, argument = path.partition("(")
    found, parts = module_of(path)
    for part in parts:
        if part.startswith("_"):
            raise LookupError(f"{path} is not public")
        found = member(found, part)
    if argument and argument.removesuffix(")") not in inspect.signature(found).parameters:
        raise LookupError(f"{path} has no argument {argument}")


def test_each_name_of_the_reference_has_one_row():
    """And no row is about anything else."""
    listed = [row["name"] for row in ROWS]
    assert len(listed) == len(set(listed))
    assert sorted(listed) == sorted(NAMES)
    assert len(NAMES) == 800


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["name"])
def test_rows_lead_somewhere(row):
    """To a name that can be imported, or to a heading of the page."""
    here = row["here"]
    if here.startswith(DECISION):
        assert f"\n### {here.removeprefix(DECISION)}\n" in PAGE
    else:
        assert here.startswith("scene_graph_ros.")
        resolve(here)


def test_each_decision_is_one_of_the_table():
    """A heading that no row leads to is out of date."""
    keys = set(re.findall(r"^### (.+)$", PAGE, re.MULTILINE))
    assert keys == {r["here"].removeprefix(DECISION) for r in ROWS if DECISION in r["here"]}


BESIDE = PAGE.partition("\n## Beside the pages\n")[2].partition("\n## ")[0]
PACKAGES = ("geometry", "planning", "trajectories")
NAMED = [
    name
    for name in re.findall(r"`([\w.()]+)`", "".join(re.findall(r"^\|.*\|(.*)\|$", BESIDE, re.M)))
    if name.partition(".")[0] in PACKAGES
]


@pytest.mark.parametrize("name", NAMED)
def test_names_beside_the_pages_are_there(name):
    """Of what the reference has beside its pages."""
    resolve(f"scene_graph_ros.{name}")


def test_the_table_beside_the_pages_was_read():
    """One name or more of each row."""
    rows = [line for line in BESIDE.splitlines() if line.startswith("| ")][2:]
    assert len(rows) > 15
    assert len(NAMED) > len(rows)
    assert all(any(f"`{each}." in row for each in PACKAGES) for row in rows if "there" not in row)


def test_what_is_not_there_is_found_out():
    """A class, a member, an argument and a field that nothing has."""
    for path in (
        "scene_graph_ros.geometry.Cube",
        "scene_graph_ros.geometry.Box.volume_of",
        "scene_graph_ros.planning.CspaceFreePolytope.binary_search(scale)",
        "scene_graph_ros.planning.PairCertificate.nothing",
    ):
        with pytest.raises(LookupError):
            resolve(path)
    assert dataclasses.is_dataclass(importlib.import_module("scene_graph_ros.geometry").Box)
