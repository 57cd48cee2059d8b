"""The walks through the files, traced: where they cross from layer to layer, and what is told."""

from __future__ import annotations

import json
import subprocess
import sys

from domains import own_domain
from node_harness import environment, ROOT
import pytest

from tools.walks import PAGE, WALKS

PROGRAM = """
import json
from tools.walks import walk_all, written
print(json.dumps({n: [[layer for layer, _ in w.legs], written(w)] for n, w in walk_all().items()}))
"""
DOWN_AND_UP = ["node", "adapters", "core", "adapters", "node"]


@pytest.fixture(scope="module")
def walks():
    """The layers that each walk goes through, and how the page is to tell it."""
    with own_domain() as domain:
        ran = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            cwd=ROOT,
            env=environment(domain, {"NUMBA_DISABLE_JIT": "1"}),
            capture_output=True,
            text=True,
            check=True,
        )
    return json.loads(ran.stdout.splitlines()[-1])


@pytest.mark.parametrize("name", ["pose", "point"])
def test_a_message_does_not_turn_back(walks, name):
    """From the node to the adapters, to the core, to the adapters, and out of the node."""
    assert walks[name][0] == DOWN_AND_UP


@pytest.mark.parametrize("name", WALKS)
def test_the_page_tells_the_walk_as_it_is(walks, name):
    """`python -m tools.walks --write` puts it right."""
    assert f"<!-- walk: {name} -->\n{walks[name][1]}\n<!-- end -->" in PAGE.read_text()
