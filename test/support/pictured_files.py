"""Mesh files whose materials have pictures, by construction: squares side by side.

Square k has x from k to k + 1 and y from 0 to 1, z = 0, a material of its own, and the whole
picture on it: (u, v) is (x - k, y).
"""

import base64
import io
import json
import struct
from urllib.parse import quote
import zlib

import numpy as np
from PIL import Image

RED, GREEN, BLUE, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)
BOARD = ((RED, GREEN), (BLUE, WHITE))
"""Four fields of a picture, the upper row first."""


def board(fields=BOARD, width=8):
    """Return texels of a picture of fields of ``width`` texels."""
    return np.repeat(np.repeat(np.array(fields, np.uint8), width, 0), width, 1)


def png(texels):
    """Return a PNG file of texels."""
    file = io.BytesIO()
    Image.fromarray(texels).save(file, "PNG")
    return file.getvalue()


def huge_png():
    """Return a PNG file that promises 8193 x 8192 pixels."""

    def chunk(kind, data):
        whole = kind + data
        return struct.pack(">I", len(data)) + whole + struct.pack(">I", zlib.crc32(whole))

    head = struct.pack(">IIBBBBB", 8193, 8192, 8, 0, 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def data_uri(kind, data):
    """Return data as an address."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def write_obj(folder, materials, name="squares"):
    """Write an OBJ and an MTL file.

    ``materials``: for each square the colour or None, and the rest of the line ``map_Kd`` or None.
    """
    lines, told = [f"mtllib {name}.mtl"], []
    for k, (color, picture) in enumerate(materials):
        told.append(f"newmtl m{k}")
        told += [] if color is None else ["Kd " + " ".join(map(str, color))]
        told += [] if picture is None else [f"map_Kd {picture}"]
        lines += [f"v {k + x} {y} 0\nvt {x} {y}" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines += [
            f"usemtl m{k}",
            "f " + " ".join(f"{4 * k + i}/{4 * k + i}" for i in (1, 2, 3, 4)),
        ]
    (folder / f"{name}.mtl").write_text("\n".join(told) + "\n")
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    return folder / f"{name}.obj"


def gltf(materials, images, *, is_binary=False, beside=None, coordinates="TEXCOORD_0"):
    """Return a glTF file, or a GLB file, whose k-th square has the k-th of the ``materials``.

    ``images`` are addresses, or the bytes of PNG files, which are kept in the file's buffer. That
    is in the file, or in the file ``beside`` it, which is written.
    """
    parts, views, accessors, primitives = [], [], [], []

    def view(data):
        at = sum(len(part) for part in parts)
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(data)})
        parts.append(data + bytes(-len(data) % 4))
        return len(views) - 1

    def accessor(array, kind):
        code = 5126 if array.dtype == np.float32 else 5125
        told = {"bufferView": view(array.tobytes()), "componentType": code}
        accessors.append({**told, "count": len(array), "type": kind})
        if kind == "VEC3":
            limits = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
            accessors[-1].update(limits)
        return len(accessors) - 1

    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    indices = accessor(np.array([0, 1, 2, 0, 2, 3], np.uint32), "SCALAR")
    # glTF counts v from above.
    uv = accessor(np.float32(np.column_stack([corners[:, 0], 1 - corners[:, 1]])), "VEC2")
    for k in range(len(materials)):
        x, y = (corners + np.float32((k, 0))).T
        # The file has +Y up: (x, y, z) is read as (x, -z, y).
        points = np.column_stack([x, np.zeros(4), -y])
        attributes = {"POSITION": accessor(points.astype(np.float32), "VEC3"), coordinates: uv}
        primitives.append({"attributes": attributes, "indices": indices, "material": k})
    pictures = [
        {"uri": one}
        if isinstance(one, str)
        else {"bufferView": view(one), "mimeType": "image/png"}
        for one in images
    ]
    data = b"".join(parts)
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"pbrMetallicRoughness": material} for material in materials],
        "textures": [{"source": k} for k in range(len(images))],
        "images": pictures,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    if beside is not None:
        beside.write_bytes(data)
        tree["buffers"][0]["uri"] = quote(beside.name)
    if not is_binary:
        tree["buffers"][0].setdefault("uri", data_uri("application/octet-stream", data))
        return json.dumps(tree).encode()
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if beside is None:
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def dae(materials):
    """Return a COLLADA file; ``materials`` are colours, or addresses of pictures."""
    images, effects, bound, surfaces = [], [], [], []
    for k, material in enumerate(materials):
        diffuse, params = f"<color>{material} 1</color>", ""
        if not isinstance(material, str):
            diffuse = f"<color>{' '.join(map(str, material))} 1</color>"
        else:
            images.append(f'<image id="i{k}"><init_from>{material}</init_from></image>')
            params = (
                f'<newparam sid="f{k}"><surface type="2D"><init_from>i{k}</init_from></surface>'
                f'</newparam><newparam sid="s{k}"><sampler2D><source>f{k}</source></sampler2D>'
                "</newparam>"
            )
            diffuse = f'<texture texture="s{k}" texcoord="UV"/>'
        effects.append(
            f'<effect id="e{k}"><profile_COMMON>{params}<technique sid="c"><lambert><diffuse>'
            f"{diffuse}</diffuse></lambert></technique></profile_COMMON></effect>"
        )
        bound.append(f'<instance_material symbol="m{k}" target="#m{k}"/>')
        a, b, c, d = range(4 * k, 4 * k + 4)
        surfaces.append(
            f'<triangles count="2" material="m{k}"><input semantic="VERTEX" source="#v" '
            'offset="0"/><input semantic="TEXCOORD" source="#t" offset="1" set="0"/>'
            f"<p>{a} 0 {b} 1 {c} 2 {a} 0 {c} 2 {d} 3</p></triangles>"
        )
    points = " ".join(
        f"{k + x} {y} 0"
        for k in range(len(materials))
        for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))
    )
    count = 4 * len(materials)
    names = "".join(
        f'<material id="m{k}"><instance_effect url="#e{k}"/></material>'
        for k in range(len(materials))
    )
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_images>{"".join(images)}</library_images>
<library_effects>{"".join(effects)}</library_effects>
<library_materials>{names}</library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="{3 * count}">{points}</float_array><technique_common>
<accessor source="#pa" count="{count}" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="8">0 0 1 0 1 1 0 1</float_array><technique_common>
<accessor source="#ta" count="4" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{"".join(surfaces)}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material>
<technique_common>{"".join(bound)}</technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()
