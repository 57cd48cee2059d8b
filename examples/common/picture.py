"""Draw what the node publishes: markers and contacts in, a ray-traced PNG out.

This stands in for RViz where there is no screen and no OpenGL: it knows nothing of the scene but
the messages. ``mitsuba`` (CPU only) traces the markers; contacts are drawn on top, so that none is
hidden, each with a number that the legend explains.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
import dataclasses
import functools
import math
from pathlib import Path
import tempfile
from urllib.parse import unquote, urlparse

import numpy as np
from PIL import Image, ImageDraw, ImageFont
import trimesh
from visualization_msgs.msg import Marker

from common.names_of_geometry import path_of
from msg_adapters.poses import pose_from_msg
from scene_graph_msgs.msg import PointContact

BACKGROUND = (0.72, 0.76, 0.80)
CONTACT_COLOR = (214, 30, 60)
COLOR_STEPS = 24
"""Shades of each channel that triangles with colours of their own are drawn in."""
UNLIT = 1.0
DISPLAY_GAMMA = 2.2
"""What pictures are encoded with."""
LEGEND_ROWS = 10
LEGEND_WIDTH = 430


@dataclasses.dataclass(frozen=True)
class Camera:
    """A pinhole camera at ``eye`` that looks at ``target`` (both p_W, metres), z up."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field_of_view: float = 38.0
    width: int = 1200
    height: int = 800

    def project(self, p_WQ: np.ndarray) -> tuple[float, float]:
        """Return the pixel (right, down) of the point Q."""
        eye, target = np.array(self.eye), np.array(self.target)
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        x, y, z = (axis @ (p_WQ - eye) for axis in (right, down, forward))
        focal = 0.5 * self.width / math.tan(math.radians(self.field_of_view) / 2)
        return self.width / 2 + focal * x / z, self.height / 2 + focal * y / z


def _resource_path(resource: str) -> Path:
    """Return the local file of a ``file://`` or ``package://`` resource."""
    url = urlparse(resource)
    if url.scheme == "file":
        return Path(unquote(url.path))
    if url.scheme == "package":
        from ament_index_python.packages import get_package_share_directory

        return Path(get_package_share_directory(url.netloc)) / unquote(url.path.lstrip("/"))
    raise ValueError(f"mesh_resource: expected file:// or package://, got {resource!r}")


def _colored(mesh: trimesh.Trimesh, rgba: Sequence[float]) -> tuple[trimesh.Trimesh, tuple]:
    return mesh, tuple(round(float(c), 3) for c in rgba)


@functools.cache
def _meshes_of_file(path: Path) -> list[trimesh.Trimesh]:
    """Return the meshes of a file, which is read once for all pictures."""
    return [mesh for mesh in trimesh.load_scene(path).dump() if isinstance(mesh, trimesh.Trimesh)]


def _meshes_of_resource(marker: Marker) -> list[tuple[trimesh.Trimesh, tuple]]:
    meshes = []
    for read in _meshes_of_file(_resource_path(marker.mesh_resource)):
        mesh = read.copy()
        rgba: Sequence[float] = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
        if marker.mesh_use_embedded_materials:
            visual = read.visual
            color = visual.main_color if visual.kind == "face" else visual.material.main_color
            rgba = np.asarray(color) / 255.0
        mesh.apply_scale([marker.scale.x, marker.scale.y, marker.scale.z])
        meshes.append(_colored(mesh, rgba))
    return meshes


def _meshes_by_color(marker: Marker, size: np.ndarray) -> list[tuple[trimesh.Trimesh, tuple]]:
    """Return the triangles of a list in the mean colours of their corners, rounded to steps.

    Such colours are data, to be read off: the fifth number says that they have light of their own.
    """
    corners = np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3, 3) * size
    rgba = np.array([(c.r, c.g, c.b, c.a) for c in marker.colors]).reshape(-1, 3, 4).mean(axis=1)
    steps, index = np.unique(np.rint(COLOR_STEPS * rgba), axis=0, return_inverse=True)
    meshes = []
    for k, step in enumerate(steps):
        mine = corners[index.ravel() == k].reshape(-1, 3)
        mesh = trimesh.Trimesh(mine, np.arange(len(mine)).reshape(-1, 3), process=False)
        meshes.append(_colored(mesh, (*(step / COLOR_STEPS), UNLIT)))
    return meshes


def _balls(marker: Marker) -> trimesh.Trimesh:
    """Return a ball around each point of a list, as an octahedron: there may be thousands."""
    centers = np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 1, 3)
    corners = np.concatenate([np.eye(3), -np.eye(3)]) * 0.5 * marker.scale.x
    faces = np.array(
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    )
    shifted = faces + 6 * np.arange(len(centers))[:, np.newaxis, np.newaxis]
    vertices = (centers + corners).reshape(-1, 3)
    return trimesh.Trimesh(vertices, shifted.reshape(-1, 3), process=False)


def _meshes_of_marker(marker: Marker) -> list[tuple[trimesh.Trimesh, tuple]]:
    """Return the triangles of a marker in the world, by colour."""
    size = np.array([marker.scale.x, marker.scale.y, marker.scale.z])
    if marker.type == Marker.MESH_RESOURCE:
        meshes = _meshes_of_resource(marker)
    elif marker.type == Marker.TRIANGLE_LIST and marker.colors:
        meshes = _meshes_by_color(marker, size)
    else:
        if marker.type == Marker.CUBE:
            mesh = trimesh.creation.box(extents=size)
        elif marker.type == Marker.SPHERE:
            mesh = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
            mesh.apply_scale(size)
        elif marker.type == Marker.CYLINDER:
            mesh = trimesh.creation.cylinder(radius=0.5, height=1.0, sections=64)
            mesh.apply_scale(size)
        elif marker.type == Marker.SPHERE_LIST:
            mesh = _balls(marker)
        elif marker.type == Marker.TRIANGLE_LIST:
            corners = np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3)
            mesh = trimesh.Trimesh(
                corners * size, np.arange(len(corners)).reshape(-1, 3), process=False
            )
        else:
            return []  # lines and text are no surfaces
        color = marker.color
        meshes = [_colored(mesh, (color.r, color.g, color.b, color.a))]
    X_WM = pose_from_msg(marker.pose, f"pose of marker {marker.ns}/{marker.id}")
    for mesh, _ in meshes:
        mesh.apply_transform(X_WM)
    return meshes


def _look(rgba: Sequence[float]) -> dict:
    """Return how a surface of this colour looks: lit by the scene, or of its own light."""
    if rgba[4:] == (UNLIT,):
        linear = [channel**DISPLAY_GAMMA for channel in rgba[:3]]
        glow = {"type": "area", "radiance": {"type": "rgb", "value": linear}}
        # They are to be seen, not to light the scene: that would take many more samples.
        return {"bsdf": _material(rgba[:4]), "emitter": {**glow, "sampling_weight": 0.0}}
    return {"bsdf": _material(rgba)}


def _material(rgba: Sequence[float]) -> dict:
    surface = {
        "type": "twosided",
        "bsdf": {
            "type": "roughplastic",
            "alpha": 0.3,
            "diffuse_reflectance": {"type": "rgb", "value": rgba[:3]},
        },
    }
    if rgba[3] > 0.99:
        return surface
    return {"type": "mask", "opacity": max(rgba[3], 0.05), "nested": surface}


def trace(markers: Iterable[Marker], camera: Camera, samples: int = 24) -> Image.Image:
    """Return the picture of the markers' surfaces, lit by the sky and a sun."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    by_color: dict[tuple, list[trimesh.Trimesh]] = defaultdict(list)
    for marker in markers:
        if marker.action == Marker.ADD:
            for mesh, rgba in _meshes_of_marker(marker):
                by_color[rgba].append(mesh)
    look_at = mi.ScalarTransform4f().look_at(camera.eye, camera.target, [0, 0, 1])
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5, "hide_emitters": False},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": BACKGROUND}},
        "sun": {"type": "directional", "direction": [-0.5, 0.7, -1.1], "irradiance": 0.8},
        "sensor": {
            "type": "perspective",
            "fov": camera.field_of_view,
            "fov_axis": "x",
            "to_world": look_at,
            "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height},
            "sampler": {"type": "multijitter", "sample_count": samples},
        },
    }
    with tempfile.TemporaryDirectory() as folder:
        for i, (rgba, meshes) in enumerate(sorted(by_color.items())):
            path = Path(folder) / f"{i}.ply"
            merged = trimesh.util.concatenate(meshes)
            trimesh.Trimesh(merged.vertices, merged.faces, process=False).export(path)
            scene[f"mesh{i}"] = {
                "type": "ply",
                "filename": str(path),
                "face_normals": True,
                **_look(rgba),
            }
        image = mi.render(mi.load_dict(scene))
    return Image.fromarray(np.array(mi.util.convert_to_bitmap(image)))


def annotate(image: Image.Image, camera: Camera, contacts: Sequence[PointContact]) -> None:
    """Draw each contact's point, its normal out of B into A, its number, and a legend."""
    draw = ImageDraw.Draw(image, "RGBA")
    font = ImageFont.load_default(17)
    deepest = sorted(contacts, key=lambda contact: -contact.depth)
    taken: list[tuple[float, float]] = []
    for number, contact in enumerate(deepest, start=1):
        p_WC = np.array([contact.point_a.x, contact.point_a.y, contact.point_a.z])
        nhat_BA_W = np.array([contact.normal.x, contact.normal.y, contact.normal.z])
        x, y = camera.project(p_WC)
        tip_x, tip_y = camera.project(p_WC + 0.12 * nhat_BA_W)
        draw.line([(x, y), (tip_x, tip_y)], fill=(*CONTACT_COLOR, 255), width=4)
        draw.ellipse([x - 6, y - 6, x + 6, y + 6], fill=(*CONTACT_COLOR, 255), outline="white")
        if number <= LEGEND_ROWS:
            draw.text(
                free_place(tip_x + 6, tip_y - 12, taken),
                str(number),
                font=font,
                fill=(*CONTACT_COLOR, 255),
                stroke_width=2,
                stroke_fill="white",
            )
    title = f"{len(contacts)} contacts" + (", the deepest:" if len(contacts) > LEGEND_ROWS else "")
    legend = [(20, 20, title)]
    for number, contact in enumerate(deepest[:LEGEND_ROWS], start=1):
        y = 66 * number
        legend += [
            (20, y, str(number)),
            (50, y, f"{1000 * contact.depth:.1f} mm"),
            (140, y, path_of(contact.geometry_a)),
            (140, y + 22, path_of(contact.geometry_b)),
        ]
    for x, y, text in legend:
        draw.text((camera.width + x, y), text, font=font, fill=(30, 30, 40, 255))


def free_place(
    x: float, y: float, taken: list[tuple[float, float]], size: float = 20.0
) -> tuple[float, float]:
    """Return a place for a number, from (x, y) on down, where none is yet; and take it, pixels."""
    while any(abs(x - a) < size and abs(y - b) < size for a, b in taken):
        y += size
    taken.append((x, y))
    return x, y


def draw_scene(
    path: Path,
    markers: Iterable[Marker],
    contacts: Sequence[PointContact],
    camera: Camera,
    samples: int = 24,
) -> None:
    """Write the picture of markers with contacts on top to ``path`` (PNG).

    It takes time in proportion to the ``samples`` of each pixel.
    """
    image = Image.new("RGB", (camera.width + LEGEND_WIDTH, camera.height), "white")
    image.paste(trace(markers, camera, samples).convert("RGB"))
    annotate(image, camera, contacts)
    image.save(path)
