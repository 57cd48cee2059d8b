"""The recipes name every file that a new shape or core takes, as it knows kinds by their names."""

from pathlib import Path
import re
import tokenize

from scene_graph_ros.geometry.compiled import kernel

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "recipes.md").read_text()
NARROWPHASE = "scene_graph_ros/geometry/narrowphase/"
KINDS_OF_CORES = {"BOX", "CYLINDER", "ELLIPSOID", "HULL", "SEGMENT", "TRIANGLE"}


def section(heading):
    """Return what stands below a heading."""
    return PAGE.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]


def files_with(names, folder):
    """Return the sources below a folder that use one of the names: strings and comments aside."""
    found = set()
    for path in (ROOT / folder).rglob("*.py"):
        if not any(name in path.read_text() for name in names):
            continue
        with path.open("rb") as source:
            words = {
                t.string for t in tokenize.tokenize(source.readline) if t.type == tokenize.NAME
            }
        if words & names:
            found.add(path.relative_to(ROOT).as_posix())
    return found


def are_named(files, text):
    """Assert that a text names each file, its path from the package's folder on or in full."""
    missing = {f for f in files if f"`{f.removeprefix('scene_graph_ros/')}`" not in text}
    assert not missing


def test_every_file_that_a_shape_takes_is_named():
    """An ellipsoid has all that a shape may have; where it is a core there is a recipe of that."""
    names = {"Ellipsoid", "ELLIPSOID"}
    files = files_with(names, "scene_graph_ros") | files_with(names, "msg_adapters")
    files = {file for file in files if not file.startswith(NARROWPHASE)}
    assert len(files) > 20
    # Those that have the shape's name are called <shape> in the recipe.
    named = {file for file in files if file.endswith(("/ellipsoid.py", "/point_ellipsoid.py"))}
    # The image of a ball is an ellipsoid, whatever shapes there are.
    of_no_shape = {"scene_graph_ros/geometry/optimization/sets/affine_ball.py"}
    are_named(files - named - of_no_shape, section("A shape"))


def test_every_file_that_a_core_takes_is_named():
    """The list of kinds, whose file is whose, and what is compiled by kinds: no algorithm asks."""
    files = files_with(KINDS_OF_CORES, NARROWPHASE)
    assert files == {
        f"{NARROWPHASE}{file}.py"
        for file in ("cores/kinds", "cores/registry", "lifted_contact_by_kind")
    }
    are_named(files, section("A core"))


def test_every_decorator_of_kernels_has_its_case():
    """All of them, and no other."""
    listed = set(re.findall(r"^\| `(\w+)` \|", section("A kernel"), re.M))
    assert listed == {name for name in kernel.__all__ if name.endswith("kernel")}
