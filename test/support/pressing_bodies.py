"""Scenes of compliant and rigid bodies, each on a frame of its own."""

import numpy as np

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)

E = 1e6


def at(x=0.0, y=0.0, z=0.0):
    """Return a pose."""
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def compliant(modulus=E, resolution=0.1, margin=None):
    """Properties of a compliant geometry."""
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, resolution, modulus, margin=margin)
    return properties


def rigid(resolution=0.1):
    """Properties of a rigid geometry."""
    properties = ProximityProperties()
    add_rigid_hydroelastic_properties(properties, resolution)
    return properties


class Scene:
    """A scene whose geometries hang on frames of their own."""

    def __init__(self):
        self.graph = SceneGraph()
        self.source = self.graph.register_source("test")
        self.ids = []
        self.frames = []
        self.poses = {}

    def add(self, shape, properties, pose, anchored=False):
        """Register a geometry and return its id."""
        name = f"g{len(self.ids)}"
        if anchored:
            instance = GeometryInstance(pose, shape, name)
            geometry = self.graph.register_anchored_geometry(self.source, instance)
        else:
            frame = self.graph.register_frame(self.source, GeometryFrame(name))
            instance = GeometryInstance(np.eye(4), shape, name)
            geometry = self.graph.register_geometry(self.source, frame, instance)
            self.frames.append(frame)
            self.poses[frame] = pose
        self.graph.assign_role(self.source, geometry, properties)
        self.ids.append(geometry)
        return geometry

    def add_deformable(self, shape, X_WG, resolution=None, properties=None):
        """Register a deformable geometry and return its id."""
        instance = GeometryInstance(X_WG, shape, f"soft{len(self.ids)}")
        instance.set_proximity_properties(properties or ProximityProperties())
        world = self.graph.world_frame_id()
        geometry = self.graph.register_deformable_geometry(
            self.source, world, instance, resolution
        )
        self.ids.append(geometry)
        return geometry

    def query(self):
        """Return queries about the scene as posed."""
        context = self.graph.create_default_context()
        context.set_frame_poses(self.source, self.poses)
        return self.graph.query_object(context)


def two(shape_A, properties_A, shape_B, properties_B, z=0.35):
    """Return queries about A at height z above B."""
    scene = Scene()
    scene.add(shape_A, properties_A, at(z=z))
    scene.add(shape_B, properties_B, at())
    return scene.query()
