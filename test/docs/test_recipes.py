"""The recipes name every file that a new shape or core takes, as it knows kinds by their names."""

from pathlib import Path
import re
import tokenize

from scene_graph_ros.geometry.compiled import kernel
from scene_graph_ros.geometry.query.distance.closed_forms import CLOSED_FORMS as PAIRS
from scene_graph_ros.geometry.query.point.closed_forms import CLOSED_FORMS as POINTS
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "recipes.md").read_text()
NARROWPHASE = "scene_graph_ros/geometry/narrowphase/"
HULLS = {"CONVEX", "MESH"}
WITHOUT_A_NAME = {
    "msg_adapters/markers.py": {"MESH"},
    "geometry/deformable/rigid_surface.py": {"BOX", "HALF_SPACE", "MESH"},
    "geometry/meshes/tessellate/__init__.py": {"HALF_SPACE"},
    "geometry/model/hydroelastic_properties.py": {"BOX", *HULLS},
    "convex/iris/scene_obstacles.py": HULLS,
    "robots/registration.py": {"CONVEX", "HALF_SPACE"},
    "geometry/query/distance/fcl_engine.py": {"MESH"},
    "views/skins.py": {"SPHERE", *HULLS},
}
"""Shapes that files of the recipe do not name: they get what is left, such as what holds of hulls,
or have nothing there. Any other that a file does not name was forgotten."""
WITH_POINTS = (
    "geometry/query/point/many_points_one_shape.py",
    "geometry/query/point/one_point_many_shapes.py",
)
"""They name what has no closed form, and leave meshes to their triangles."""
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
        words = words_of(path)
        if words & names:
            found.add(path.relative_to(ROOT).as_posix())
    return found


def words_of(path):
    """Return the names in a file, without strings and comments."""
    with path.open("rb") as source:
        return {t.string for t in tokenize.tokenize(source.readline) if t.type == tokenize.NAME}


def are_named(files, text):
    """Assert that a text names each file, its path from the package's folder on or in full."""
    missing = {f for f in files if f"`{f.removeprefix('scene_graph_ros/')}`" not in text}
    assert not missing


def files_of_shapes():
    """Return the files that know kinds of shapes: an ellipsoid has all that a shape may have."""
    names = {"Ellipsoid", "ELLIPSOID"}
    files = files_with(names, "scene_graph_ros") | files_with(names, "msg_adapters")
    # A core that it is has a recipe of its own. Those with the shape's name are of it alone. The
    # image of a ball is an ellipsoid, whatever shapes there are.
    return {
        file
        for file in files
        if not file.startswith(NARROWPHASE)
        and not file.endswith(("/ellipsoid.py", "/point_ellipsoid.py", "/sets/affine_ball.py"))
    }


def test_every_file_that_a_shape_takes_is_named():
    """Each that knows kinds of shapes."""
    files = files_of_shapes()
    assert len(files) > 20
    are_named(files, section("A shape"))


def test_every_file_that_a_shape_takes_knows_every_shape():
    """A shape that was forgotten somewhere would be answered for as if it were another."""
    missing = {}
    for file in files_of_shapes():
        words, name = words_of(ROOT / file), file.removeprefix("scene_graph_ros/")
        without = set()
        for kind in ShapeKind:
            title = kind.name.title().replace("_", "")
            known = {kind.name, f"_{kind.name}", f"{kind.name}_KIND", title, f"{title}Spec"}
            if not words & known:
                without.add(kind.name)
        missing[name] = without
    points = {kind.name for kind in POINTS} | {"MESH"}
    expected = {**WITHOUT_A_NAME, **dict.fromkeys(WITH_POINTS, points)}
    expected["geometry/query/point/dispatch.py"] = points - {"MESH"}
    assert {name: kinds for name, kinds in missing.items() if kinds} == expected


def test_every_shape_has_a_closed_form_with_half_spaces():
    """A half space is no core, so no other algorithm answers for it."""
    half_space = ShapeKind.HALF_SPACE
    others = set(ShapeKind) - {half_space}
    pairs = {tuple(sorted((kind, half_space))) for kind in others}
    assert pairs <= set(PAIRS)


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
