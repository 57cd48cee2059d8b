"""Images of cameras: depth, label and colour of the geometries with the perception role.

A renderer is added to a scene graph by a name, which the camera says; ``ExactRenderEngine`` is
our own, ``TracedRenderEngine`` adds light and shadows, ``GltfClientRenderEngine`` asks a server.
Pixels, axes and images are described in ``docs/cameras.md``.
"""

from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.geometry.perception.camera import (
    CameraIntrinsics,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)
from scene_graph_ros.geometry.perception.camera_description import (
    CameraDescription,
    CameraOutput,
)
from scene_graph_ros.geometry.perception.camera_properties import (
    CameraProperties,
    DepthCameraProperties,
)
from scene_graph_ros.geometry.perception.engine import ImageKind, Images, RenderEngine
from scene_graph_ros.geometry.perception.exact.exact_render_engine import ExactRenderEngine
from scene_graph_ros.geometry.perception.gltf.gltf_client_render_engine import (
    GltfClientRenderEngine,
)
from scene_graph_ros.geometry.perception.traced.environment_map import EnvironmentMap
from scene_graph_ros.geometry.perception.traced.lights import LightParameter
from scene_graph_ros.geometry.perception.traced.traced_render_engine import TracedRenderEngine

__all__ = [
    "CameraDescription",
    "CameraIntrinsics",
    "CameraOutput",
    "CameraProperties",
    "ClippingRange",
    "ColorRenderCamera",
    "DepthCameraProperties",
    "DepthRange",
    "DepthRenderCamera",
    "EnvironmentMap",
    "ExactRenderEngine",
    "GltfClientRenderEngine",
    "ImageKind",
    "Images",
    "LightParameter",
    "RenderCameraCore",
    "RenderEngine",
    "RenderLabel",
    "TracedRenderEngine",
]
