"""No module of ours can be imported, or understood, only together with one that imports it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
import subprocess
import sys

import pytest

from tools.circles import circle, imports_of

ROOT = Path(__file__).parents[2]

WAYS = {
    "at the top": "from pkg.b import B\n",
    "as a module": "import pkg.b\n",
    "from its package": "from pkg import b\n",
    "in a function": "def late():\n    from pkg.b import B\n    return B\n",
    "for annotations": (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from pkg.b import B\n"
    ),
}


def written(root, files):
    """Write modules of a package, and return what each imports."""
    (root / "pkg").mkdir()
    for name, text in files.items():
        (root / "pkg" / f"{name}.py").write_text(text)
    return imports_of(root, ["pkg"])


@pytest.mark.parametrize("way", WAYS)
def test_a_circle_is_found_however_it_is_closed(tmp_path, way):
    """Of three modules, of which one closes it; others lead to it and away from it."""
    imports = written(
        tmp_path,
        {
            "__init__": "",
            "a": WAYS[way],
            "b": "from pkg.c import C\n",
            "c": "from pkg.a import A\nfrom pkg.below import X\n",
            "above": "from pkg.a import A\n",
            "below": "import os\n",
        },
    )
    found = circle(imports)
    assert found[0] == found[-1]
    assert sorted(found[1:]) == ["pkg.a", "pkg.b", "pkg.c"]
    for module, imported in pairwise(found):
        assert imported in imports[module]


def test_what_only_points_down_is_no_circle(tmp_path):
    """Two ways to the same module, and a package that hands on names, are none."""
    imports = written(
        tmp_path,
        {
            "__init__": "from pkg.a import A\n",
            "a": "from pkg.b import B\nfrom pkg.c import C\n",
            "b": "from pkg.c import C\n",
            "c": "import os\n",
        },
    )
    assert imports["pkg"] == {"pkg.a"}
    assert imports["pkg.a"] == {"pkg.b", "pkg.c"}
    assert circle(imports) == []


def test_there_is_none():
    """As `make lint` says."""
    done = subprocess.run(
        [sys.executable, "-m", "tools.circles"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[0]) > 400
