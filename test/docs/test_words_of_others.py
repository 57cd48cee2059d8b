"""Tables of others' words and ours: each of our words is there."""

from functools import cache
import importlib
import inspect
from pathlib import Path
import re

import pytest

import scene_graph_msgs.msg
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.scene_files import json_schema

ROOT = Path(__file__).parents[2]
PAGES = ["coming_from_moveit.md", "coming_from_drake.md"]
MODULES = ("geometry", "geometry.optimization", "geometry.perception", "planning", "robots")
MORE = ("planning.trajectories", "scene_files", "geometry.query.results")


def ours(page):
    """Return what stands in backquotes in the right-hand column of the page's tables."""
    rows = re.findall(r"^\| (.+) \| (.+) \|$", (ROOT / "docs" / page).read_text(), re.M)
    return [name for row in rows for name in re.findall(r"`([^`]+)`", row[1])]


@cache
def public():
    """Return all public names of the core, with those of classes."""
    found = set()
    for module in (*MODULES, *MORE):
        package = importlib.import_module(f"scene_graph_ros.{module}")
        for name in package.__all__:
            found.add(name)
            if inspect.isclass(getattr(package, name)):
                found.update(n for n in dir(getattr(package, name)) if not n.startswith("_"))
    return found


@cache
def of_the_node():
    """Return names of services, topics, parameters, keys of scenes and fields of goals."""
    found = {parameter.name for parameter in PARAMETERS}
    for path in (ROOT / "scene_graph_msgs").glob("*/*.*"):
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in path.stem).lstrip("_")
        found |= {f"~/{words}"} if path.suffix != ".msg" else set()
        found |= set(re.findall(r"^\S+ (\w+)", path.read_text(), re.M))
    found |= set(re.findall(r"`(~/[\w/]+)`", (ROOT / "docs" / "node.md").read_text()))
    found |= set(dir(scene_graph_msgs.msg))
    definitions = json_schema()
    schemas = [definitions, *definitions["$defs"].values()]
    return found | {key for schema in schemas for key in schema.get("properties", {})}


@pytest.mark.parametrize("page", PAGES)
def test_our_words_are_there(page):
    """Public names of Python, services, topics, parameters, keys, fields and modules."""
    names = ours(page)
    assert len(names) > 25
    for name in names:
        if name.startswith("scene_graph_ros."):
            importlib.import_module(name)
        elif re.fullmatch(r"(~/)?[A-Za-z][\w/]*", name):
            assert name in public() or name in of_the_node(), name
