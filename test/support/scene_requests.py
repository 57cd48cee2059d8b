"""Requests that several tests send, and the scene that they send them about."""

from __future__ import annotations

from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3

from scene_graph_msgs.msg import (
    CameraDescription,
    FrameDescription,
    GeometryDescription,
    GeometryReference,
    QueryOptions,
    RoleProperties,
    SceneCamera,
    Shape,
    Status,
    WhatIf,
)

RADIUS = 0.3
"""Metres, of the balls."""


def pose(x=0.0, y=0.0, z=0.0):
    """Return a pose without rotation."""
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0))


def sphere(name, radius=RADIUS, at=None, roles=(RoleProperties.PROXIMITY,)):
    """Return the description of a sphere."""
    return GeometryDescription(
        name=name,
        shape=Shape(kind=Shape.SPHERE, dimensions=[radius]),
        pose=at or pose(),
        roles=[RoleProperties(role=role) for role in roles],
    )


def camera(name, frame="", *, images=("depth",), rate=30.0, renderer="exact", **fields):
    """Return a camera of 4 x 3 pixels at a frame's origin; ``fields`` are of its description."""
    description = {"pose": pose(), "width": 4, "height": 3, "fov_y": 1.0} | fields
    return SceneCamera(
        name=name,
        description=CameraDescription(frame=frame, **description),
        images=list(images),
        rate=rate,
        renderer=renderer,
    )


def reference(name):
    """Return a reference by name."""
    return GeometryReference(name=name)


def what_if(frame, *positions):
    """Return configurations in which one frame is at each of the positions."""
    poses = [number for p in positions for number in (*map(float, p), 0.0, 0.0, 0.0, 1.0)]
    return QueryOptions(what_if=WhatIf(frames=[frame], poses=poses))


def register_balls(client):
    """Register two balls 0.5 m apart, so that they overlap by 0.1 m; return their source.

    The gap is |AB| - 2 RADIUS = 0.5 - 0.6 = -0.1.
    """
    source = client.call("RegisterSource", name="balls").source
    frames = [
        FrameDescription(name="a", pose=pose()),
        FrameDescription(name="b", pose=pose(x=0.5)),
    ]
    answer = client.call("RegisterFrame", source=source, frames=frames)
    assert answer.status.code == Status.OK, answer.status
    for frame in ("a", "b"):
        answer = client.call(
            "RegisterGeometry", source=source, frame=frame, geometries=[sphere(f"ball_{frame}")]
        )
        assert answer.status.code == Status.OK, answer.status
    return source


def transform(x):
    """Return a transform without rotation."""
    return Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))
