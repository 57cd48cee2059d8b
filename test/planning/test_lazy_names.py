"""Names that packages import when they are asked for."""

import importlib
import pkgutil
import sys

import pytest

PACKAGES = (
    "geometry.optimization",
    "node",
    "planning",
    "planning.certified",
    "planning.trajectories",
    "robots",
    "scene_files",
)


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_has_the_name_of_what_is_imported_late(package):
    """Whoever imports the module first would find it in the place of the function."""
    found = importlib.import_module(f"scene_graph_ros.{package}")
    modules = {module.name for module in pkgutil.iter_modules(found.__path__)}
    assert found.__all__
    assert modules & set(found.__all__) == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_the_names_that_a_package_lists_are_those_it_imports(package):
    """No name is listed alone, none imported alone; another one is no attribute."""
    found = importlib.import_module(f"scene_graph_ros.{package}")
    assert set(found.__all__) <= set(dir(found))
    for name in found.__all__:
        assert getattr(found, name) is not None
    with pytest.raises(AttributeError, match=f"'scene_graph_ros.{package}' has no attribute"):
        _ = found.nothing


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with a module that is imported late, and one that can't be."""
    folder = tmp_path / "lazy_package"
    folder.mkdir()
    (folder / "__init__.py").write_text(
        "from typing import TYPE_CHECKING\n\n"
        "from scene_graph_ros.lazy_names import lazy_names\n\n"
        "if TYPE_CHECKING:\n"
        "    from lazy_package.good import one\n"
        "    from lazy_package.bad import two\n"
        '__all__ = ["one", "two"]\n'
        "__getattr__, __dir__ = lazy_names(__name__)\n"
    )
    (folder / "good.py").write_text("one = object()\n")
    (folder / "bad.py").write_text("import sys\nsys.nothing_of_this_name\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield importlib.import_module("lazy_package")
    for name in [each for each in sys.modules if each.partition(".")[0] == "lazy_package"]:
        del sys.modules[name]


def test_a_name_is_imported_once_when_it_is_used(package):
    """Not with the package; and it is the module's own object."""
    assert "lazy_package.good" not in sys.modules
    first = package.one
    assert first is sys.modules["lazy_package.good"].one
    assert vars(package)["one"] is first


def test_an_attribute_that_a_module_lacks_is_told_as_a_failed_import(package):
    """Python would take an AttributeError for a name that the package has not."""
    with pytest.raises(ImportError, match=r"lazy_package.bad can't be imported: module 'sys'"):
        _ = package.two
