"""Polygons become triangles with all their corners."""

import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.io import read_mesh_contents
from scene_graph_ros.geometry.meshes.polygons import triangles_of_polygons
from scene_graph_ros.geometry.meshes.surfaces import build_surface


def star(corners, seed):
    """Return a star-shaped polygon (n, 3) in a plane of any direction, and its area."""
    rng = np.random.default_rng(seed)
    # No two are half a turn apart: it goes around the origin once.
    angles = 2.0 * np.pi * (np.arange(corners) + rng.uniform(0.0, 0.8, corners)) / corners
    radii = rng.uniform(0.2, 1.0, corners)
    flat = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    x, y = flat.T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return flat @ axes[:, :2].T + rng.normal(size=3), area


@pytest.mark.parametrize("corners", [4, 5, 8, 20, 60])
def test_triangles_cover_a_polygon_once(corners):
    """Their areas add up to the polygon's, each turned the same way: so none is outside of it."""
    for seed in range(20):
        points, area = star(corners, seed)
        triangles = triangles_of_polygons(points, np.arange(corners), np.array([corners]))
        assert triangles.shape == (corners - 2, 3)
        assert set(triangles.ravel().tolist()) == set(range(corners))
        a, b, c = (points[triangles[:, k]] for k in range(3))
        crosses = np.cross(b - a, c - a)
        assert np.linalg.norm(crosses, axis=1).sum() == pytest.approx(2.0 * abs(area), rel=1e-9)


NOTCH = [(2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (0, 0)]
N = len(NOTCH)
VERTICES = [(x, y, z) for z in (0, 1) for x, y in NOTCH]
POLYGONS = [
    list(range(N))[::-1],
    list(range(N, 2 * N)),
    *([i, (i + 1) % N, N + (i + 1) % N, N + i] for i in range(N)),
]


def obj():
    """Return the L in this format."""
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES)
    return text + "".join("f " + " ".join(str(i + 1) for i in p) + "\n" for p in POLYGONS)


def off():
    """Return the L in this format."""
    text = f"OFF # \n{len(VERTICES)} {len(POLYGONS)} 0\n"
    text += "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
    return text + "".join(f"{len(p)} {' '.join(map(str, p))}\n" for p in POLYGONS)


def ply():
    """Return the L in this format."""
    head = f"ply\nformat ascii 1.0\ncomment st\xfcck\nelement vertex {len(VERTICES)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(POLYGONS)}\nproperty list uchar int vertex_indices\nend_header\n"
    text = "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES)
    return head + text + "".join(f"{len(p)} {' '.join(map(str, p))}\n" for p in POLYGONS)


def binary_ply():
    """Return the L in this format."""
    head = ply().partition("end_header\n")[0].replace("ascii", "binary_big_endian")
    data = np.array(VERTICES, ">f4").tobytes()
    for polygon in POLYGONS:
        data += bytes([len(polygon)]) + np.array(polygon, ">i4").tobytes()
    return head.encode("latin-1") + b"end_header\n" + data


def dae():
    """Return the L in this format."""
    numbers = " ".join(str(x) for v in VERTICES for x in v)
    indices = " ".join(str(i) for p in POLYGONS for i in p)
    counts = " ".join(str(len(p)) for p in POLYGONS)
    return (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        "<asset><up_axis>Z_UP</up_axis></asset>"
        '<library_geometries><geometry id="g"><mesh><source id="s">'
        f'<float_array id="a" count="{3 * len(VERTICES)}">{numbers}</float_array>'
        f'<technique_common><accessor source="#a" count="{len(VERTICES)}" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/>'
        '<param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>'
        f'<polylist count="{len(POLYGONS)}"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"<vcount>{counts}</vcount><p>{indices}</p></polylist></mesh></geometry>"
        '</library_geometries><library_visual_scenes><visual_scene id="w"><node>'
        '<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#w"/></scene></COLLADA>'
    )


@pytest.mark.parametrize("form", [obj, off, ply, binary_ply, dae])
def test_a_notch_stays_a_notch_in_every_format(form):
    """An L of 3 cubic metres, closed, whatever its caps begin with."""
    contents = form()
    data = contents if isinstance(contents, bytes) else contents.encode("latin-1")
    kind = form.__name__.removeprefix("binary_")
    surface = build_surface(*read_mesh_contents(data, kind, name="L"), name="L")
    assert surface.is_closed
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("first", [0, 1, 3])
def test_a_corner_on_a_straight_edge_is_kept(first):
    """The neighbour has it too, so the cube stays closed."""
    cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv .5 0 0\n"
    cube += "f 5 6 7 8\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    for face in ([1, 4, 3, 2, 9], [1, 9, 2, 6, 5]):
        cube += "f " + " ".join(map(str, np.roll(face, -first))) + "\n"
    surface = build_surface(*read_mesh_contents(cube.encode(), "obj", name="c"), name="c")
    assert surface.is_closed
    assert not surface.report.repairs
