"""Files of polygons, in each format that has them."""

import numpy as np

__all__ = ["POLYGON_WRITERS", "prism"]


def prism(flat):
    """Return the corners and faces of a prism of height 1 over a polygon (n, 2)."""
    n = len(flat)
    points = np.vstack([np.column_stack([flat, np.full(n, z)]) for z in (0.0, 1.0)])
    sides = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    return points, [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


def _rows(rows):
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows)


def obj(points, faces):
    """Return polygons in this format."""
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
    text += "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)
    return text.encode()


def off(points, faces):
    """Return polygons in this format."""
    head = f"OFF # \n{len(points)} {len(faces)} 0\n"
    return (head + _rows(points.tolist()) + _rows([len(f), *f] for f in faces)).encode()


def _ply_head(points, faces, form):
    head = f"ply\nformat {form} 1.0\ncomment st\xfcck\nelement vertex {len(points)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list int int vertex_indices\nend_header\n"
    return head.encode("latin-1")


def ply(points, faces):
    """Return polygons in this format, in words."""
    rows = _rows(points.tolist()) + _rows([len(f), *f] for f in faces)
    return _ply_head(points, faces, "ascii") + rows.encode()


def binary_ply(points, faces):
    """Return polygons in this format, the largest byte of numbers first."""
    data = points.astype(">f8").tobytes()
    data += b"".join(np.array([len(face), *face], ">i4").tobytes() for face in faces)
    return _ply_head(points, faces, "binary_big_endian") + data


def dae(points, faces):
    """Return polygons in this format, as a polylist."""
    counts = " ".join(str(len(face)) for face in faces)
    indices = " ".join(str(i) for face in faces for i in face)
    return _dae(points, len(faces), "polylist", f"<vcount>{counts}</vcount><p>{indices}</p>")


def dae_polygons(points, faces):
    """Return polygons in this format, each with an element of its own."""
    texts = (" ".join(map(str, face)) for face in faces)
    return _dae(points, len(faces), "polygons", "".join(f"<p>{text}</p>" for text in texts))


def _dae(points, count, kind, body):
    numbers = " ".join(repr(x) for p in points.tolist() for x in p)
    return (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        "<asset><up_axis>Z_UP</up_axis></asset>"
        '<library_geometries><geometry id="g"><mesh><source id="s">'
        f'<float_array id="a" count="{3 * len(points)}">{numbers}</float_array>'
        f'<technique_common><accessor source="#a" count="{len(points)}" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/>'
        '<param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>'
        f'<{kind} count="{count}"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"{body}</{kind}></mesh></geometry>"
        '</library_geometries><library_visual_scenes><visual_scene id="w"><node>'
        '<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#w"/></scene></COLLADA>'
    ).encode()


POLYGON_WRITERS = {
    ("obj", ""): obj,
    ("off", ""): off,
    ("ply", "words"): ply,
    ("ply", "binary"): binary_ply,
    ("dae", "polylist"): dae,
    ("dae", "polygons"): dae_polygons,
}
"""By the file's type and variant: functions of points (n, 3) and lists of corners."""
