"""Packages that are optional: one sentence says that one is missing, and how to install it."""

from pathlib import Path
import re

import pytest

from scene_graph_ros.missing_package import not_installed

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("requirement", ["ompl", "mitsuba==3.9.1"])
def test_the_sentence_names_the_use_the_package_and_the_command(requirement):
    """The command has the version that is needed, the name of the package has not."""
    sentence = not_installed("a planner", requirement)
    name = requirement.split("==")[0]
    assert sentence == (
        f"a planner takes the package {name}, which is not installed: pip install {requirement}"
    )


def test_no_other_code_words_it_for_itself():
    """Damaged wheels are another matter: what they say is about this package."""
    found = {
        str(path.relative_to(ROOT / "scene_graph_ros"))
        for path in (ROOT / "scene_graph_ros").rglob("*.py")
        if re.search(r"pip install (?!--force-reinstall)", path.read_text())
    }
    assert found == {"missing_package.py"}
