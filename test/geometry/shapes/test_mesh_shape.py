"""Convex and Mesh: where their data comes from, and their scale."""

import copy
import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import Convex, Mesh
from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tolerances import MIN_SCALE

VERTICES = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
OBJ = (
    "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES)
    + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)
).encode()
BOTH = pytest.mark.parametrize("shape_type", [Convex, Mesh])


@pytest.fixture(name="path")
def _path(tmp_path):
    path = tmp_path / "Tetrahedron.OBJ"
    path.write_bytes(OBJ)
    return path


@BOTH
def test_shape_from_a_file(shape_type, path):
    """A file's path is made absolute, its extension says the type."""
    shape = shape_type(path, scale=2.0)
    assert shape.path == path
    assert shape.filename == str(path)
    assert (shape.file_type, shape.extension) == ("obj", ".obj")
    assert shape.scale == (2.0, 2.0, 2.0)
    assert shape.vertices is None
    assert shape.contents is None


@BOTH
def test_relative_path_is_made_absolute(shape_type, path, monkeypatch):
    """A later change of the working directory does not matter."""
    monkeypatch.chdir(path.parent)
    shape = shape_type(path.name)
    assert shape.path.is_absolute()
    assert shape == shape_type(str(path))
    assert shape == shape_type(f"../{path.parent.name}/{path.name}")


@BOTH
def test_shape_from_memory(shape_type):
    """The content of a file is kept with its type."""
    shape = shape_type(contents=OBJ, file_type=".OBJ")
    assert shape.contents == OBJ
    assert shape.file_type == "obj"
    assert shape.filename == ""


@BOTH
def test_shape_from_arrays(shape_type):
    """Arrays are copied and cannot be written to."""
    vertices = np.array(VERTICES)
    shape = shape_type(vertices=vertices, faces=FACES)
    vertices[0] = 7.0
    assert shape.vertices.tolist() == [list(v) for v in VERTICES]
    assert shape.faces.tolist() == [list(f) for f in FACES]
    for array in (shape.vertices, shape.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1


def test_kinds():
    """The two classes have their own kinds."""
    assert Convex(vertices=VERTICES).kind is ShapeKind.CONVEX
    assert Mesh(vertices=VERTICES, faces=FACES).kind is ShapeKind.MESH


def test_mesh_of_vertices_needs_faces():
    """Points alone are a Convex, not a Mesh."""
    with pytest.raises(InvalidShapeError, match="faces"):
        Mesh(vertices=VERTICES)


@BOTH
@pytest.mark.parametrize(
    ("scale", "expected"),
    [(0.5, (0.5, 0.5, 0.5)), (-1, (-1.0, -1.0, -1.0)), ((1, -2, 3), (1.0, -2.0, 3.0))],
)
def test_scale_is_one_number_or_three(shape_type, scale, expected):
    """Negative factors mirror and are accepted."""
    assert shape_type(vertices=VERTICES, faces=FACES, scale=scale).scale == expected


@BOTH
@pytest.mark.parametrize(
    "scale",
    [
        0.0,
        0.99 * MIN_SCALE,
        -0.99 * MIN_SCALE,
        (1, 0, 1),
        np.nan,
        (1, np.inf, 1),
        (1, 2),
        "big",
        1e10,
    ],
)
def test_bad_scale_is_refused_with_its_value(shape_type, scale):
    """A scale near zero, not finite, or of another shape is refused."""
    with pytest.raises(InvalidShapeError, match="scale") as caught:
        shape_type(vertices=VERTICES, faces=FACES, scale=scale)
    assert repr(scale) in str(caught.value)
    assert shape_type.__name__ in str(caught.value)


@BOTH
def test_smallest_scale_is_accepted(shape_type):
    """The bound itself is fine, with either sign."""
    scale = (MIN_SCALE, -MIN_SCALE, 1.0)
    assert shape_type(vertices=VERTICES, faces=FACES, scale=scale).scale == scale


@BOTH
def test_missing_file_is_refused(shape_type, tmp_path):
    """A file that is not there is named with the reason."""
    with pytest.raises(InvalidShapeError, match=r"missing\.obj.*No such file"):
        shape_type(tmp_path / "missing.obj")


@BOTH
def test_folder_is_refused(shape_type, tmp_path):
    """A folder is no file."""
    with pytest.raises(InvalidShapeError, match="cannot read file"):
        shape_type(tmp_path)


@BOTH
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "exactly one"),
        ({"vertices": VERTICES, "contents": OBJ}, "exactly one"),
        ({"contents": OBJ}, "file_type"),
        ({"contents": OBJ, "file_type": " "}, "file_type"),
        ({"contents": b"", "file_type": "obj"}, "contents"),
        ({"vertices": VERTICES, "faces": FACES, "file_type": "obj"}, "file_type"),
        ({"contents": OBJ, "file_type": "obj", "faces": FACES}, "faces"),
        ({"vertices": [], "faces": FACES}, "vertices"),
        ({"vertices": [(0, 0)], "faces": FACES}, "vertices"),
        ({"vertices": [(0, 0, 0), (0, np.nan, 0)], "faces": FACES}, r"vertices\[1\]"),
        ({"vertices": [(0, 0, 0), (0, 1e10, 0)], "faces": FACES}, r"vertices\[1\]"),
        ({"vertices": "points", "faces": FACES}, "vertices"),
        ({"vertices": VERTICES, "faces": [(0, 1, 4)]}, r"faces\[0\]"),
        ({"vertices": VERTICES, "faces": [(0, 1, 2), (0, 1, -1)]}, r"faces\[1\]"),
        ({"vertices": VERTICES, "faces": [(0.0, 1.0, 2.0)]}, "faces"),
        ({"vertices": VERTICES, "faces": [(0, 1)]}, "faces"),
        ({"vertices": VERTICES, "faces": [(0, 1, 2), (0, 1)]}, "faces"),
        ({"path": 7}, "path"),
    ],
)
def test_bad_data_is_refused(shape_type, arguments, words):
    """The error names the class and what is wrong."""
    with pytest.raises(InvalidShapeError, match=words) as caught:
        shape_type(**arguments)
    assert str(caught.value).startswith(shape_type.__name__)


@BOTH
def test_equality_by_data_and_scale(shape_type, path):
    """The same data with the same scale is the same shape; the way it came in counts."""
    shapes = [
        shape_type(path),
        shape_type(path, 2.0),
        shape_type(contents=OBJ, file_type="obj"),
        shape_type(contents=OBJ + b"\n", file_type="obj"),
        shape_type(vertices=VERTICES, faces=FACES),
        shape_type(vertices=VERTICES, faces=FACES[::-1]),
        shape_type(vertices=VERTICES[::-1], faces=FACES),
    ]
    for i, a in enumerate(shapes):
        for j, b in enumerate(shapes):
            assert (a == b) == (i == j)
    again = shape_type(vertices=np.array(VERTICES), faces=np.array(FACES, dtype=np.int32))
    assert again == shapes[4]
    assert hash(again) == hash(shapes[4])


def test_convex_and_mesh_differ():
    """The same data as hull and as triangles are two shapes."""
    assert Convex(vertices=VERTICES, faces=FACES) != Mesh(vertices=VERTICES, faces=FACES)


def test_source_key_leaves_the_scale_out():
    """Shapes of one source share their key, so it is read once."""
    small, large = (Convex(vertices=VERTICES, scale=s) for s in (1.0, 3.0))
    assert small.source_key == large.source_key
    assert small.source_key != Convex(vertices=VERTICES[::-1]).source_key


def test_source_key_of_a_file_changes_with_the_file(path):
    """A file that was written again is another source."""
    before = Mesh(path)
    path.write_bytes(OBJ + b"# changed\n")
    assert Mesh(path).source_key != before.source_key


@BOTH
def test_copy_and_pickle(shape_type):
    """Copies are equal and still immutable."""
    shape = shape_type(vertices=VERTICES, faces=FACES, scale=(1, 2, -3))
    for same in (copy.deepcopy(shape), pickle.loads(pickle.dumps(shape))):
        assert same == shape
        assert not same.vertices.flags.writeable


@BOTH
def test_immutable(shape_type):
    """Nothing can be set on a shape."""
    shape = shape_type(vertices=VERTICES, faces=FACES)
    with pytest.raises(AttributeError, match="immutable"):
        shape.scale = (1.0, 1.0, 1.0)


@BOTH
def test_with_scale(shape_type):
    """The same data with another scale."""
    shape = shape_type(vertices=VERTICES, faces=FACES)
    assert shape.with_scale(2.0) == shape_type(vertices=VERTICES, faces=FACES, scale=2.0)
    assert shape.scale == (1.0, 1.0, 1.0)


def test_repr(path):
    """The text shows where the data comes from, not the data."""
    assert repr(Mesh(path)) == f"Mesh({str(path)!r}, scale=1.0)"
    assert repr(Convex(vertices=VERTICES, scale=(1, 2, 3))) == (
        "Convex(vertices=<4>, scale=(1.0, 2.0, 3.0))"
    )
    assert "file_type='obj'" in repr(Mesh(contents=OBJ, file_type="obj"))
