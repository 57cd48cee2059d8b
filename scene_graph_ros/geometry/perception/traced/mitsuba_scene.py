"""A camera's view as a scene of Mitsuba's: everything in the sensor's frame S.

Mitsuba counts in single precision. Seen from the sensor, positions are small and keep their
digits, wherever in the world all of it is. Colours are turned from sRGB into linear light, in
which light adds up, and back in the end.
"""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception.camera import CameraIntrinsics, RenderCameraCore
from scene_graph_ros.geometry.perception.exact.bodies import Bodies
from scene_graph_ros.geometry.perception.exact.cover import Cover
from scene_graph_ros.geometry.perception.picture_bodies import with_one_picture_each
from scene_graph_ros.geometry.perception.srgb import linear
from scene_graph_ros.geometry.perception.surfaces import Patch, patch_of_shape
from scene_graph_ros.geometry.perception.traced.environment_map import EnvironmentMap
from scene_graph_ros.geometry.perception.traced.lights import LightParameter
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["Tracing", "trace"]

_VARIANT = "scalar_rgb"
_FULL = float(np.pi)
"""Irradiance, W/m^2, that has a white surface send out a radiance of 1."""
_FAR = 4.0
"""Of the farthest depth: how far a half space reaches around the camera."""
_BEAM = 0.8
"""Of a spot's angle: where it begins to fade."""

FloatArray = NDArray[np.float64]
_lock = threading.Lock()
"""Mitsuba keeps which variant of itself is meant, and its threads, for the whole process."""


class Tracing(NamedTuple):
    """How light is traced: see TracedRenderEngine."""

    lights: tuple[LightParameter, ...]
    ambient: float
    samples: int
    max_depth: int
    seed: int
    environment: EnvironmentMap | None = None


def trace(
    tracing: Tracing,
    bodies: Bodies,
    cover: Cover,
    core: RenderCameraCore,
    X_WS: FloatArray,
) -> FloatArray:
    """Return linear red, green and blue, times alpha, and alpha, ``(height, width, 4)``."""
    import mitsuba

    mi: Any = mitsuba  # its own annotations are of all its variants
    bodies, cover = with_one_picture_each(bodies, cover)
    lens = core.intrinsics
    height = (
        lens.height if lens.fx == lens.fy else int(np.ceil(lens.height * lens.fx / lens.fy)) + 2
    )
    with _lock:
        mi.set_variant(_VARIANT)
        mi.set_log_level(mi.LogLevel.Error)
        scene: dict[str, Any] = {
            "type": "scene",
            "integrator": {
                # The latter lets light through what is transparent, on its way to a surface, too.
                "type": "volpath" if cover.is_transparent.any() else "path",
                "max_depth": tracing.max_depth,
                "hide_emitters": tracing.environment is None or not tracing.environment.skybox,
            },
            "sensor": _sensor(mi, core, height),
            **_lights(mi, tracing, X_WS),
        }
        for row in range(len(bodies.kind)):
            if cover.alpha[row] > 0.0:
                X_SG = _seen_from(X_WS, bodies.X_WG[row])
                scene[f"body_{row}"] = _body(mi, bodies, cover, row, X_SG, core.clipping.far)
        made = mi.load_dict(scene)
        image = np.array(mi.render(made, seed=tracing.seed, spp=tracing.samples), np.float64)
    return image if height == lens.height else _rows(image, lens)


def _sensor(mi: Any, core: RenderCameraCore, height: int) -> dict[str, Any]:
    """Return a camera with square pixels; its film has ``height`` rows."""
    lens = core.intrinsics
    cy = lens.cy if height == lens.height else lens.cy * lens.fx / lens.fy
    return {
        "type": "perspective",
        "fov": float(2.0 * np.degrees(np.arctan(0.5 * lens.width / lens.fx))),
        "fov_axis": "x",
        "near_clip": core.clipping.near,
        "far_clip": core.clipping.far,
        # Pixels' centres are whole numbers for us, halves for Mitsuba.
        "principal_point_offset_x": (0.5 * lens.width - lens.cx - 0.5) / lens.width,
        "principal_point_offset_y": (0.5 * height - cy - 0.5) / height,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=[0, 0, 0], target=[0, 0, 1], up=[0, -1, 0]
        ),
        "film": {
            "type": "hdrfilm",
            "width": lens.width,
            "height": height,
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter"},
    }


def _rows(image: FloatArray, lens: CameraIntrinsics) -> FloatArray:
    """Return the rows of a lens whose fy is not fx, each between two that were traced."""
    y = np.arange(lens.height) * lens.fx / lens.fy
    low = np.floor(y).astype(np.int64)
    share = (y - low)[:, None, None]
    return (1.0 - share) * image[low] + share * image[low + 1]


def _seen_from(X_WS: FloatArray, X_WG: FloatArray) -> FloatArray:
    """Return X_SG; positions are subtracted before they are rotated."""
    X_SG = np.eye(4)
    X_SG[:3, :3] = X_WS[:3, :3].T @ X_WG[:3, :3]
    X_SG[:3, 3] = X_WS[:3, :3].T @ (X_WG[:3, 3] - X_WS[:3, 3])
    return X_SG


def _lights(mi: Any, tracing: Tracing, X_WS: FloatArray) -> dict[str, Any]:
    lights = {
        f"light_{k}": _light(mi, light, X_WS)
        for k, light in enumerate(tracing.lights)
        if light.intensity > 0.0
    }
    if tracing.environment is not None:
        # Mitsuba's has +y up and begins at -z, then +x.
        R_WE = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        X_SE = np.eye(4)
        X_SE[:3, :3] = X_WS[:3, :3].T @ R_WE
        lights["environment"] = {
            "type": "envmap",
            "bitmap": mi.Bitmap(np.float32(tracing.environment.texture)),
            "to_world": mi.ScalarTransform4f(X_SE),
        }
    elif tracing.ambient > 0.0:
        lights["ambient"] = {"type": "constant", "radiance": tracing.ambient}
    return lights


def _light(mi: Any, light: LightParameter, X_WS: FloatArray) -> dict[str, Any]:
    R, p = (X_WS[:3, :3].T, X_WS[:3, 3]) if light.frame == "world" else (np.eye(3), np.zeros(3))
    color = linear(light.color.as_array()[:3]) * light.intensity * _FULL
    power = {"type": "rgb", "value": color.tolist()}
    ahead = R @ (np.array(light.direction) / np.linalg.norm(light.direction))
    place = R @ (np.array(light.position) - p)
    if light.type == "directional":
        return {"type": "directional", "direction": ahead.tolist(), "irradiance": power}
    if light.type == "point":
        return {"type": "point", "position": place.tolist(), "intensity": power}
    side = np.eye(3)[int(np.abs(ahead).argmin())]
    angle = float(np.degrees(light.cone_angle))
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(
            origin=place.tolist(), target=(place + ahead).tolist(), up=side.tolist()
        ),
        "intensity": power,
        "cutoff_angle": angle,
        "beam_width": _BEAM * angle,
    }


def _body(mi: Any, bodies: Bodies, cover: Cover, row: int, X_SG: FloatArray, far: float) -> Any:
    """Return a body as Mitsuba's mesh, in S."""
    if bodies.kind[row] > ShapeKind.HALF_SPACE:
        patch, paint = _triangles(bodies, cover, row)
    else:
        # Of a half space, what is below the camera.
        foot = -X_SG[:3, :3].T @ X_SG[:3, 3]
        patch = patch_of_shape(int(bodies.kind[row]), bodies.size[row], _FAR * far, foot)
        paint = None
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(_surface(mi, bodies, cover, row, paint is not None))
    has_picture = cover.picture[row] >= 0
    mesh = mi.Mesh(
        f"body_{row}",
        len(patch.vertices),
        len(patch.triangles),
        has_vertex_normals=patch.normals is not None,
        has_vertex_texcoords=bool(has_picture),
        props=properties,
    )
    if paint is not None:
        mesh.add_attribute("face_color", 3, np.float32(paint).ravel())
    data = mi.traverse(mesh)
    R, p = X_SG[:3, :3], X_SG[:3, 3]
    data["vertex_positions"] = np.float32(patch.vertices @ R.T + p).ravel()
    data["faces"] = np.uint32(patch.triangles).ravel()
    if patch.normals is not None:
        data["vertex_normals"] = np.float32(patch.normals @ R.T).ravel()
    if has_picture:
        assert patch.uv is not None  # it was refused without
        # Mitsuba counts rows of pictures from above.
        uv = patch.uv * cover.repeats[row]
        data["vertex_texcoords"] = np.float32(np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])).ravel()
    data.update()
    return mesh


def _triangles(bodies: Bodies, cover: Cover, row: int) -> tuple[Patch, FloatArray | None]:
    """Return a mesh, each triangle with corners of its own, and linear colours of its file."""
    mesh = bodies.mesh[row]
    first, last = bodies.triangle_start[mesh], bodies.triangle_start[mesh + 1]
    start, stop = bodies.vertex_start[mesh], bodies.vertex_start[mesh + 1]
    triangles, vertices = bodies.triangles[first:last], bodies.vertices[start:stop]
    count = len(triangles)
    paint = None
    if bodies.is_painted[row]:
        palette = np.concatenate([bodies.palette, bodies.diffuse[row : row + 1]])
        paint = linear(palette[bodies.paint[first:last]])  # -1 is the last: the body's own
    if cover.picture[row] < 0:
        return Patch(vertices, triangles.astype(np.int64), None, None), paint
    at = cover.first[row]
    uv = cover.corners[at : at + count].reshape(-1, 2)
    corners = vertices[triangles].reshape(-1, 3)
    return Patch(corners, np.arange(3 * count).reshape(-1, 3), None, uv), paint


def _surface(mi: Any, bodies: Bodies, cover: Cover, row: int, is_painted: bool) -> dict[str, Any]:
    """Return a matt surface, alike on both sides, seen through by its alpha."""
    own = linear(bodies.diffuse[row])
    opacity: Any = float(cover.alpha[row])
    if is_painted:
        reflectance: dict[str, Any] = {"type": "mesh_attribute", "name": "face_color"}
    elif cover.picture[row] >= 0:
        texels = _texels(cover, row)
        reflectance = _bitmap(mi, linear(texels[..., :3]) * own)
        if (texels[..., 3] < 1.0).any():
            opacity = _bitmap(mi, texels[..., 3:] * opacity)
    else:
        reflectance = {"type": "rgb", "value": own.tolist()}
    matt = {"type": "twosided", "matt": {"type": "diffuse", "reflectance": reflectance}}
    if isinstance(opacity, float) and opacity >= 1.0:
        return matt
    return {"type": "mask", "opacity": opacity, "matt": matt}


def _texels(cover: Cover, row: int) -> FloatArray:
    """Return the picture of a body, ``(height, width, 4)`` from 0 to 1."""
    picture = cover.picture[row]
    width, height = cover.size[picture]
    start = cover.start[picture]
    return cover.texels[start : start + width * height].reshape(height, width, 4) / 255.0


def _bitmap(mi: Any, values: FloatArray) -> dict[str, Any]:
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(values, np.float32)),
        "raw": True,
        "filter_type": "bilinear",
        "wrap_mode": "repeat",
    }
