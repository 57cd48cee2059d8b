"""A mesh in pieces means the union of their hulls: for queries, in reports, on disk."""

import subprocess
import sys

import numpy as np
import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.meshes import sources
from scene_graph_ros.geometry.meshes.obj_file import obj_objects, parse_obj
from scene_graph_ros.geometry.meshes.other_process import LibraryError
from scene_graph_ros.geometry.meshes.pieces import coacd_split
from scene_graph_ros.geometry.model.mesh_properties import mesh_meant
from scene_graph_ros.geometry.optimization import scene_obstacles
from scene_graph_ros.geometry.shapes.mesh_pieces import MeshPieces

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]


def box(lower, upper, start):
    """Return the lines of an OBJ file with a box whose first corner is number ``start`` + 1."""
    points = np.array(lower) + CORNERS * np.subtract(upper, lower)
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    return lines + ["f " + " ".join(str(c + start) for c in side) for side in SIDES]


def angle(first="o foot", second="o leg", third=""):
    """Return an L of two boxes, each an object; ``third`` comes before all."""
    foot, leg = box((0, 0, 0), (3, 1, 1), 0), box((0, 0, 1), (1, 1, 3), 8)
    return "\n".join([third, first, *foot, second, *leg, ""])


def properties(**values):
    """Return proximity properties of the group "mesh"."""
    result = ProximityProperties()
    for name, value in values.items():
        result.add_property("mesh", name, value)
    return result


def query_of(mesh, ball, radius=0.5, **values):
    """Return a query of a mesh and a ball, and their ids."""
    graph = SceneGraph()
    source = graph.register_source("s")
    ids = []
    for shape, at, of in (
        (mesh, (0, 0, 0), properties(**values)),
        (Sphere(radius), ball, ProximityProperties()),
    ):
        X = np.eye(4)
        X[:3, 3] = at
        instance = GeometryInstance(X, shape, f"g{len(ids)}")
        instance.set_proximity_properties(of)
        frame = graph.register_frame(source, GeometryFrame(f"f{len(ids)}"))
        ids.append(graph.register_geometry(source, frame, instance))
    return graph.query_object(graph.create_default_context()), *ids


OBJ = Mesh(contents=angle(), file_type="obj")
L_POINTS, L_FACES = parse_obj(angle().encode(), "L", [])


@pytest.mark.parametrize("word", ["objects", "coacd"])
def test_queries_see_the_hollow_between_pieces(word):
    """A ball of radius 1/2 at (2, 1/2, 7/4) is 1/4 m above the foot, and inside of the hull."""
    query, mesh, ball = query_of(OBJ, (2.0, 0.5, 1.75), pieces=word)
    found = query.compute_signed_distance_pair_closest_points(mesh, ball)
    assert found.distance == pytest.approx(0.25, abs=5e-3)
    assert not query.has_collisions()
    hull, mesh, ball = query_of(OBJ, (2.0, 0.5, 1.75))
    assert hull.has_collisions()
    # Inside of the leg, beside where the boxes touch: 0.3 m from the sides.
    query, mesh, ball = query_of(OBJ, (0.3, 0.5, 1.0), 0.1, pieces=word)
    (at,) = [
        d
        for d in query.compute_signed_distance_to_point(np.array((0.3, 0.5, 1.0)))
        if d.id_G == mesh
    ]
    assert at.distance == pytest.approx(-0.3, abs=5e-3)
    assert query.compute_point_pair_penetration()[0].depth == pytest.approx(0.4, abs=5e-3)


def test_the_report_has_the_pieces_and_how_far_they_leave_the_solid():
    """Exactly convex objects do not; the L's own hull is sqrt(2) / sqrt(2) = 1 m too far out.

    Between the arms it has the triangle (1, 1), (3, 1), (1, 3), of which (2, 2) is 1 m from both.
    """
    query, mesh, _ = query_of(OBJ, (9, 9, 9), pieces="objects")
    pieces = query.inspector().get_mesh_report(mesh).pieces
    assert pieces.count == 2
    assert pieces.outside_solid == pytest.approx(0.0, abs=1e-11)
    assert pieces.outside_hulls == pytest.approx(0.0, abs=1e-11)
    assert max(pieces.outside_solid_bound, pieces.outside_hulls_bound) < 0.02
    one = Mesh(contents=angle("o both", "o both"), file_type="obj")
    query, mesh, _ = query_of(one, (9, 9, 9), pieces="objects")
    report = query.inspector().get_mesh_report(mesh)
    assert report.pieces.count == 1
    assert 0.98 <= report.pieces.outside_solid <= 1.0 <= report.pieces.outside_solid_bound <= 1.03
    assert "1 convex piece, with points" in str(report)
    assert (report.parts, report.is_closed) == (2, True)


def test_pieces_that_leave_something_out():
    """A flat object on top of a box 1 m high is a sheet; the box below is an object of points."""
    flat = ["o lid", "v 0 0 1", "v 1 0 1", "v 0 1 1", "f 1 2 3", "o rest"]
    mesh = Mesh(contents="\n".join([*flat, *box((0, 0, 0), (1, 1, 0.25), 3)]), file_type="obj")
    query, ball, _ = query_of(mesh, (9, 9, 9), pieces="objects")
    report = query.inspector().get_mesh_report(ball)
    assert report.pieces.count == 2
    assert report.sheets == 1
    assert report.pieces.outside_hulls == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (angle(), [0] * 12 + [1] * 12),
        (angle("g foot", "g leg"), [0] * 12 + [1] * 12),
        (angle("o one\ng foot", "g leg"), [0] * 24),
        (angle("# nothing", "o leg"), [0] * 12 + [1] * 12),
        (angle("o same", "o same"), [0] * 24),
        (angle("o  a b # c", "o a  b"), [0] * 24),
        (angle("o", "o leg"), [0] * 12 + [1] * 12),
        (angle("usemtl a", "usemtl b"), [0] * 24),
    ],
)
def test_objects_of_a_file(text, expected):
    """They are told by ``o``, or by ``g`` without any ``o``; equal names are one object."""
    assert obj_objects(text.encode()).tolist() == expected


def test_a_split_is_kept_by_its_contents(monkeypatch, meshes_kept_apart):
    """Another process, here another shape of the same points, does not split again."""
    calls = []
    run = coacd_split.run_library
    monkeypatch.setattr(
        coacd_split, "run_library", lambda *a, **k: calls.append(1) or run(*a, **k)
    )
    mesh = Mesh(vertices=L_POINTS * (1.0, 1.0, 0.875), faces=L_FACES)
    by = MeshPieces("coacd", 0.05, 0)
    first = sources.hulls_of(mesh.with_pieces(by))
    assert calls == [1]
    for cache in (sources._piece_hulls, sources._surfaces):
        cache._entries.clear()
    again = sources.hulls_of(mesh.with_pieces(by))
    assert calls == [1]
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
    sources.hulls_of(mesh.with_pieces(MeshPieces("coacd", 0.06, 0)))
    assert calls == [1, 1]


def test_coacd_gives_the_same_pieces_each_time():
    """Of the same solid, threshold and seed."""
    surface = sources.surface_of(OBJ)
    runs = [coacd_split._split(surface, MeshPieces("coacd", 0.05, 3), "L") for _ in range(2)]
    for name in ("points", "counts"):
        np.testing.assert_array_equal(runs[0][name], runs[1][name])


def test_an_open_mesh_is_wrapped_by_the_library(monkeypatch):
    """So is one that it fails at as it is; the report is about the file and the pieces."""
    asked = []

    def split(program, given, **options):
        asked.append(str(given["wrapping"]))
        if asked == ["off"]:
            raise LibraryError("no idea")
        return {"points": CORNERS * 3.0, "counts": np.array([8])}

    monkeypatch.setattr(coacd_split, "run_library", split)
    by = MeshPieces("coacd", 0.05, 0)
    closed = Mesh(vertices=L_POINTS * 1.75, faces=L_FACES)
    assert len(sources.hulls_of(closed.with_pieces(by))) == 1
    assert asked == ["off", "on"]
    lines = box((0, 0, 0), (3, 3, 3), 0)[:-1]
    opened = Mesh(contents="\n".join(lines), file_type="obj")
    report = sources.report_of(opened.with_pieces(by))
    assert asked == ["off", "on", "on"]
    assert (report.sheets, report.is_closed) == (1, False)
    # Each face of the cube is moved by 6e-5 of the size; its middle is 1.5 m from the walls.
    assert 1.45 <= report.pieces.outside_solid <= 1.5002 <= report.pieces.outside_solid_bound
    assert report.pieces.outside_hulls == 0.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"pieces": "vhacd"}, r"'pieces'\) must be 'coacd' or 'objects', not 'vhacd'"),
        ({"pieces": 3}, r"'pieces'\) must be 'coacd' or 'objects', not 3"),
        ({"pieces": "coacd", "pieces_threshold": 0.0}, r"must be a number from 0.01 to 1"),
        ({"pieces": "coacd", "pieces_seed": -1}, r"'pieces_seed'\) must be a whole number from 0"),
        ({"pieces": "coacd", "pieces_seed": 1.5}, "is 1.5 of type float, not int"),
        ({"pieces": "objects", "pieces_seed": 1}, r"'pieces_seed'\) comes with"),
        ({"pieces_threshold": 0.1}, r"'pieces_threshold'\) comes with .* = 'coacd'"),
        ({"pieces": "coacd", "representation": "convex_hull"}, "leave one of them out"),
    ],
)
def test_wrong_properties_are_refused(values, message):
    """By their name and value, before anything is read."""
    with pytest.raises(PropertyError, match=message):
        query_of(OBJ, (9, 9, 9), **values)


def test_pieces_are_of_files_that_have_them():
    """Objects of an OBJ file alone."""
    mesh = Mesh(vertices=L_POINTS, faces=L_FACES)
    with pytest.raises(
        MeshError, match=r"an array has no objects .* pieces by 'coacd' are of any"
    ):
        query_of(mesh, (9, 9, 9), pieces="objects")


def test_without_the_library_the_extra_is_named(monkeypatch):
    """Nothing of another version is taken from the disk."""
    monkeypatch.setattr(coacd_split, "_installed", lambda: "")
    mesh = Mesh(vertices=L_POINTS * 1.5, faces=L_FACES)
    with pytest.raises(
        MeshError, match="takes the package coacd, which is not installed: pip install coacd"
    ):
        query_of(mesh, (9, 9, 9), pieces="coacd")


def test_a_library_that_fails_is_a_mesh_error(monkeypatch):
    """Whatever happens to its process; the last line it says is told."""
    program = "import sys; sys.exit('no idea')"
    monkeypatch.setattr(coacd_split, "_PROGRAM", program)
    mesh = Mesh(vertices=L_POINTS * 2.5, faces=L_FACES)
    with pytest.raises(MeshError, match="could not be split into convex pieces: no idea"):
        query_of(mesh, (9, 9, 9), pieces="coacd")


def test_other_roles_are_drawn_as_they_are(tmp_path):
    """Collision is drawn as its pieces, with the file's triangles beside it for looks."""
    from scene_graph_ros.geometry import IllustrationProperties, Role
    from scene_graph_ros.views.items import draw_items
    from scene_graph_ros.views.looks import triangles_of

    graph = SceneGraph()
    instance = GeometryInstance(
        np.eye(4), Mesh(contents=angle("o both", "o both"), file_type="obj"), "L"
    )
    instance.set_proximity_properties(properties(pieces="objects"))
    instance.set_illustration_properties(IllustrationProperties())
    drawn = graph.register_anchored_geometry(graph.register_source("s"), instance)
    inspector = graph.model_inspector()
    counts = {}
    for role in (Role.PROXIMITY, Role.ILLUSTRATION):
        (item,) = draw_items(inspector, role, [drawn])
        counts[role] = len(triangles_of(item).triangles)
    # The hull of the L: two pentagons and five quadrilaterals, cut into triangles.
    assert counts == {Role.PROXIMITY: 2 * 3 + 5 * 2, Role.ILLUSTRATION: 24}


def test_regions_grow_into_the_hollow():
    """Of the mesh in pieces there are two obstacles, and the ball is another one."""
    query, mesh, _ = query_of(OBJ, (9, 9, 9), pieces="objects")
    assert [each.geometry_id for each in scene_obstacles(query)].count(mesh) == 2
    sets = [each.convex_set for each in scene_obstacles(query) if each.geometry_id == mesh]
    assert not any(each.point_in_set((2.0, 0.5, 2.0)) for each in sets)


def test_check_tells_of_pieces(tmp_path, capsys):
    """Of a mesh file by an option, of a scene by its properties."""
    path = tmp_path / "angle.obj"
    path.write_text(angle())
    assert main(["--pieces", "objects", str(path)]) == 0
    assert "2 convex pieces, with points" in capsys.readouterr().out
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "version: 1\nsources: [{name: s}]\ngeometries:\n"
        "  - {source: s, name: L, shape: {type: mesh, file: angle.obj},\n"
        "     roles: {proximity: {mesh: {pieces: objects}}}}\n"
    )
    assert main([str(scene)]) == 0
    assert "mesh 'L': 2 convex pieces" in capsys.readouterr().out


def test_nothing_is_imported_without_the_property():
    """Neither the library nor this folder."""
    program = (
        "import sys, numpy as np\n"
        "from scene_graph_ros.geometry import Mesh\n"
        "from scene_graph_ros.geometry.meshes.sources import validate\n"
        f"validate(Mesh(vertices={CORNERS.tolist()}, faces=[[0, 1, 2], [1, 3, 2]]))\n"
        "print([m for m in sys.modules if 'coacd' in m or '.meshes.pieces' in m])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_the_shape_has_what_the_properties_say():
    """Numbers too; of what is no mesh nothing is asked."""
    meant = mesh_meant(OBJ, properties(pieces="coacd", pieces_threshold=0.2, pieces_seed=7))
    assert meant.pieces == MeshPieces("coacd", 0.2, 7)
    assert meant != OBJ
    assert mesh_meant(meant, properties()) == OBJ
