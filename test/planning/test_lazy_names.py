"""Names that packages import when they are asked for."""

import importlib
import pkgutil

import pytest


@pytest.mark.parametrize("package", ["planning", "planning.trajectories", "robots", "scene_files"])
def test_no_module_has_the_name_of_what_is_imported_late(package):
    """Whoever imports the module first would find it in the place of the function."""
    found = importlib.import_module(f"scene_graph_ros.{package}")
    modules = {module.name for module in pkgutil.iter_modules(found.__path__)}
    assert found.__all__
    assert modules & set(found.__all__) == set()
