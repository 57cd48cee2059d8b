"""COLLADA files of the corner of a box: a tetrahedron of four points, written in many ways."""

from __future__ import annotations

__all__ = ["FACES", "INPUT", "POINTS", "corner", "skinned"]

POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
FACES = f'<triangles count="4">{INPUT}<p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>'
_SPACE = 'xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"'


def corner(
    *,
    numbers="0 0 0 1 0 0 0 1 0 0 0 1",
    params="XYZ",
    count=4,
    stride=3,
    offset=0,
    faces=FACES,
    mesh="mesh",
    scene='<node><instance_geometry url="#g"/></node>',
    shown='<instance_visual_scene url="#w"/>',
    libraries="",
    unit="1",
    space=_SPACE,
):
    """Return the bytes of a file.

    ``numbers`` are positions, for ``count``, ``stride``, ``offset`` and the names ``params``;
    ``faces`` and ``scene`` are elements, as are the ``libraries`` beside.
    """
    named = "".join(f'<param name="{name}" type="float"/>' for name in params)
    return (
        f'<COLLADA {space}><asset><unit meter="{unit}"/></asset>{libraries}<library_geometries>'
        f'<geometry id="g"><{mesh}><source id="p"><float_array id="a">{numbers}</float_array>'
        f'<technique_common><accessor source="#a" count="{count}" stride="{stride}" '
        f'offset="{offset}">{named}</accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
        f"{faces}</{mesh}></geometry></library_geometries><library_visual_scenes>"
        f'<visual_scene id="w">{scene}</visual_scene></library_visual_scenes>'
        f"<scene>{shown}</scene></COLLADA>"
    ).encode()


def skinned(beside=""):
    """Return arguments of ``corner``: its mesh is bent by a skin, with other nodes ``beside``."""
    return {
        "scene": f'{beside}<node><instance_controller url="#k"/></node>',
        "libraries": '<library_controllers><controller id="k"><skin source="#g"/></controller>'
        "</library_controllers>",
    }
