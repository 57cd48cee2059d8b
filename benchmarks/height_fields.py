"""What a height field costs beside other systems: ``python -m benchmarks.height_fields``.

A field of 1000 x 1000 cells of 1 cm, hills with noise of 2 mm. A hull of 10 cm, which covers
10 x 10 cells, is put at many places, beside the ground and in it; each is asked about by itself
with new poses. Coal's HeightField and MuJoCo's hfield are asked the same where they are
installed, for contacts within a margin of 1 cm: neither has distances. The last column has what
each says of the nearest of all places.
Times are of the processor, the least of some rounds, in turns. With ``--picture FILE`` it draws a
field, hulls and the prisms that are nearest to them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import os
from pathlib import Path
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import machine
from scene_graph_ros.geometry import (
    Convex,
    FrameId,
    GeometryFrame,
    GeometryInstance,
    HeightField,
    ProximityProperties,
    SceneGraph,
    Shape,
    SourceId,
)
from scene_graph_ros.geometry.query.elements.field_kernels import find_prisms
from scene_graph_ros.geometry.query.elements.scene import clouds_of
from scene_graph_ros.geometry.tables.height_grid import place_heights

__all__ = ["main"]

FloatArray = NDArray[np.float64]

_CELLS, _LENGTH, _FLOOR, _RADIUS = 1000, 10.0, -1.0, 0.05
_GAPS = {"5 mm above": 0.005, "touching": 0.0, "2 cm in it": -0.02}
_PLACES, _ROUNDS, _MARGIN = 400, 5, 0.01


def hills(seed: int = 0) -> FloatArray:
    """Return heights ``(1001, 1001)``, in m."""
    x = np.linspace(-0.5 * _LENGTH, 0.5 * _LENGTH, _CELLS + 1)
    noise = np.random.default_rng(seed).normal(0.0, 0.002, (len(x), len(x)))
    result: FloatArray = 0.2 * np.sin(2.0 * x) * np.cos(1.5 * x)[:, np.newaxis] + noise
    return result


def hull(vertices: int = 24) -> FloatArray:
    """Return corners ``(v, 3)`` on a ball, in m."""
    p = np.random.default_rng(1).normal(size=(vertices, 3))
    result: FloatArray = _RADIUS * p / np.linalg.norm(p, axis=1)[:, np.newaxis]
    return result


def poses(heights: FloatArray, gap: float) -> FloatArray:
    """Return poses ``(n, 4, 4)`` of the hull so high above the ground below its middle, about."""
    rng = np.random.default_rng(2)
    X = np.tile(np.eye(4), (_PLACES, 1, 1))
    for each in X:
        q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        each[:3, :3] = q * np.sign(np.linalg.det(q))
        each[:2, 3] = rng.uniform(-4.0, 4.0, 2)
        j, i = np.rint((each[:2, 3] / _LENGTH + 0.5) * _CELLS).astype(int)
        each[2, 3] = heights[i - 5 : i + 6, j - 5 : j + 6].max() + _RADIUS + gap
    return X


class Ours:
    """A scene with so many hulls, and the kernel that its queries ask."""

    def __init__(self, heights: FloatArray, corners: FloatArray, count: int) -> None:
        self.graph = SceneGraph()
        ground, self.robot = (self.graph.register_source(name) for name in ("map", "robot"))
        field, body = HeightField(heights, (_LENGTH, _LENGTH), _FLOOR), Convex(vertices=corners)
        self._add(ground, SceneGraph.world_frame_id(), field, "field")
        for k in range(count):
            frame = self.graph.register_frame(self.robot, GeometryFrame(f"tool_{k}"))
            self._add(self.robot, frame, body, f"tool_{k}")
        self.context = self.graph.create_default_context()
        self.query = self.graph.query_object(self.context)

    def _add(self, source: SourceId, frame: FrameId, shape: Shape, name: str) -> None:
        instance = GeometryInstance(np.eye(4), shape, name)
        instance.set_proximity_properties(ProximityProperties())
        self.graph.register_geometry(source, frame, instance)

    def distances(self, X: FloatArray) -> list[float]:
        """Ask the kernel about all poses in one call."""
        clouds = clouds_of(self.query.snapshot)
        places, still = clouds.table.own_places(), np.ascontiguousarray(clouds.X_WC)
        rows, found = np.arange(len(X)), np.empty((len(X), 2))
        find_prisms(places, 0, X, still, rows, 1.0, found)
        result: list[float] = found[:, 0].tolist()
        return result

    def queries(self, X: FloatArray) -> list[float]:
        """Set each pose and ask the query that users ask."""
        result = []
        for each in X:
            self.context.set_frame_poses(self.robot, each[np.newaxis])
            (pair,) = self.query.compute_signed_distance_pairwise_closest_points()
            result.append(pair.distance)
        return result


def coal_contacts(heights: FloatArray, corners: FloatArray) -> Callable[[FloatArray], Any] | None:
    """Return a function that asks Coal, or None where it is not installed."""
    try:
        import coal
    except ImportError:
        return None
    # Coal's first row is the one with the largest y.
    field = coal.HeightFieldOBBRSS(_LENGTH, _LENGTH, np.ascontiguousarray(heights[::-1]), _FLOOR)
    vertices = coal.StdVec_Vec3s()
    vertices.extend(list(corners))
    body = coal.Convex.convexHull(vertices, False, "Qt")
    still = coal.Transform3s()
    request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, 100_000)
    request.security_margin = _MARGIN

    def ask(X: FloatArray) -> list[float]:
        result = []
        for each in X:
            pose, answer = coal.Transform3s(each[:3, :3], each[:3, 3]), coal.CollisionResult()
            coal.collide(field, still, body, pose, request, answer)
            found = [answer.getContact(k).penetration_depth for k in range(answer.numContacts())]
            result.append(min(found, default=np.inf))
        return result

    return ask


def mujoco_contacts(
    heights: FloatArray, corners: FloatArray
) -> Callable[[FloatArray], Any] | None:
    """Return a function that asks MuJoCo, or None where it is not installed."""
    try:
        import mujoco
    except ImportError:
        return None
    low, top = heights.min(), heights.max()
    rows, cols = heights.shape
    text = " ".join(f"{x:.17g}" for x in corners.ravel())
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset>
        <hfield name="h" nrow="{rows}" ncol="{cols}" size="{_LENGTH / 2} {_LENGTH / 2}
         {top - low} {low - _FLOOR}"/><mesh name="m" vertex="{text}" inertia="convex"/></asset>
        <worldbody><geom type="hfield" hfield="h" pos="0 0 {low}" margin="{_MARGIN}"/>
        <body mocap="true"><geom type="mesh" mesh="m" margin="{_MARGIN}"/></body></worldbody>
        </mujoco>"""
    )
    model.hfield_data[:] = ((heights - low) / (top - low)).ravel()
    data = mujoco.MjData(model)

    def ask(X: FloatArray) -> list[float]:
        result = []
        quaternion = np.empty(4)
        for each in X:
            mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(each[:3, :3]).ravel())
            data.mocap_pos[0], data.mocap_quat[0] = each[:3, 3], quaternion
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            result.append(min((c.dist for c in data.contact), default=np.inf))
        return result

    return ask


def _times(ways: dict[str, Callable[[FloatArray], Any]], X: FloatArray) -> dict[str, float]:
    """Return the least time of a question, us, of each way, asked in turns."""
    least = dict.fromkeys(ways, np.inf)
    for _ in range(_ROUNDS):
        for name, ask in ways.items():
            begin = time.process_time()
            ask(X)
            least[name] = min(least[name], 1e6 * (time.process_time() - begin) / len(X))
    return least


def picture(path: Path) -> None:
    """Draw a piece of the field from the side, with hulls and the prisms nearest to them."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    from scene_graph_ros.geometry.shapes.field_surface import (
        drawn_places,
        field_triangles,
        field_vertices,
    )

    rng = np.random.default_rng(4)
    x = np.linspace(-1.0, 1.0, 25)
    heights = 0.15 * np.sin(4.0 * x) * np.cos(3.0 * x)[:, np.newaxis]
    heights += rng.normal(0.0, 0.01, heights.shape)
    graph = SceneGraph()
    ground, robot = graph.register_source("map"), graph.register_source("robot")
    field, corners = HeightField(heights, (2.0, 2.0), -0.4), 3.0 * hull()
    instance = GeometryInstance(np.eye(4), field, "field")
    instance.set_proximity_properties(ProximityProperties())
    graph.register_anchored_geometry(ground, instance)
    centers = np.array([[-0.6, -0.5, 0.3], [0.4, 0.3, 0.45], [0.6, -0.6, 0.1]])
    for k, center in enumerate(centers):
        frame = graph.register_frame(robot, GeometryFrame(f"frame_{k}"))
        X = np.eye(4)
        X[:3, 3] = center
        body = GeometryInstance(X, Convex(vertices=corners), f"body_{k}")
        body.set_proximity_properties(ProximityProperties())
        graph.register_geometry(robot, frame, body)
    query = graph.query_object(graph.create_default_context())
    pairs = [
        pair
        for pair in query.compute_signed_distance_pairwise_closest_points()
        if max(pair.element_A, pair.element_B) >= 0
    ]
    places = drawn_places(field)
    vertices, triangles = field_vertices(field, heights, places), field_triangles(places)
    colors = np.tile([0.75, 0.7, 0.55, 1.0], (len(triangles), 1))
    for pair in pairs:
        colors[max(pair.element_A, pair.element_B)] = [0.85, 0.1, 0.1, 1.0]
    from scipy.spatial import ConvexHull

    faces = ConvexHull(corners).simplices
    bodies = np.concatenate([(corners + center)[faces] for center in centers])
    shown = np.concatenate([vertices[triangles], bodies])
    colors = np.concatenate([colors, np.tile([0.2, 0.4, 0.8, 0.5], (len(bodies), 1))])
    figure = plt.figure(figsize=(8, 5.4))
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    axes.add_collection3d(
        Poly3DCollection(shown, facecolors=colors, edgecolors=(0, 0, 0, 0.25), lw=0.2)
    )
    for pair in pairs:
        ends = [
            (query.get_pose_in_world(i) @ [*p, 1.0])[:3]
            for i, p in ((pair.id_A, pair.p_ACa), (pair.id_B, pair.p_BCb))
        ]
        axes.plot(*np.array(ends).T, color="k", marker="o", markersize=3, zorder=10)
        axes.text(*(ends[1] + [0.0, 0.0, 0.2]), f"{1e3 * pair.distance:.1f} mm", zorder=11)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-0.4, 0.6), xlabel="x / m", ylabel="y / m")
    axes.set_box_aspect((2, 2, 1), zoom=1.25)
    axes.view_init(28, -60)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, or draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, metavar="FILE")
    wanted = parser.parse_args(arguments).picture
    if wanted is not None:
        picture(wanted)
        return
    heights, corners = hills(), hull()
    print(machine(os.getloadavg()[0]))
    begin = time.process_time()
    grid = place_heights(heights, (_LENGTH, _LENGTH), _FLOOR).grid
    build = time.process_time() - begin
    size = sum(array.nbytes for array in grid)
    print(f"built in {1e3 * build:.1f} ms, {1e-6 * size:.2f} MB of which heights", end=" ")
    print(f"{1e-6 * heights.nbytes:.2f} MB")
    ways: dict[str, Callable[[FloatArray], Any]] = {
        "kernel": Ours(heights, corners, _PLACES).distances,
        "query": Ours(heights, corners, 1).queries,
    }
    peers = {
        "Coal": coal_contacts(heights, corners),
        "MuJoCo": mujoco_contacts(heights, corners),
    }
    ways |= {name: peer for name, peer in peers.items() if peer is not None}
    print("| hull | " + " | ".join(f"{name} us" for name in ways) + " | least mm |")
    print("| --- |" + " ---: |" * len(ways) + " --- |")
    for place, gap in _GAPS.items():
        X = poses(heights, gap)
        least = ", ".join(f"{1e3 * min(ask(X)):.3f}" for ask in ways.values())
        took = _times(ways, X)
        print(f"| {place} | " + " | ".join(f"{us:.1f}" for us in took.values()) + f" | {least} |")


if __name__ == "__main__":
    main()
