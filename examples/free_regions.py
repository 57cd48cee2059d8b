"""Grow regions that nothing of a scene is in, keep them as YAML, and draw them.

    .venv/bin/python examples/free_regions.py

The scene is the demo's robot cell as it starts, or any other scene file. From each sample a region
grows until its ellipsoid does not any more; then each face is shown to keep its obstacles out.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import dataclasses
import math
from pathlib import Path
import sys
import time

from common.picture import Camera, trace
from geometry_msgs.msg import Point, Quaternion, Vector3
import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from msg_adapters.markers import SceneMarkers
from msg_adapters.names import SceneNames
from msg_adapters.scene import marker_items
from scene_graph_ros.geometry import QueryObject, Role, SceneGraph
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    iris,
    IrisRegion,
    make_iris_obstacles,
    save_iris_regions_yaml_file,
    VPolytope,
)
from scene_graph_ros.scene_files import load_scene, SceneFileError

ROOT = Path(__file__).parents[1]
SAMPLES = ((0.55, 0.0, 0.75), (0.55, 0.05, 0.2), (0.0, 0.62, 0.9), (-0.45, -0.3, 0.8))
"""Over the table, under it, before the shelf, and behind the robot."""
ROOM = HPolyhedron.make_box([-0.7, -0.8, 0.0], [1.1, 0.95, 1.3])
COLORS = ((0.1, 0.5, 0.9), (0.95, 0.6, 0.1), (0.2, 0.7, 0.3), (0.7, 0.3, 0.8))
CAMERA = Camera(
    eye=(3.3, -2.9, 2.1), target=(0.2, 0.05, 0.6), field_of_view=34.0, width=840, height=600
)
ROD = 0.012
"""Metres. Diameter of what regions are drawn with."""


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--scene", type=Path, default=ROOT / "config" / "scenes" / "panda_cell.yaml"
    )
    parser.add_argument(
        "--sample",
        type=float,
        nargs=3,
        action="append",
        metavar=("X", "Y", "Z"),
        help="where a region begins, in metres; may be given several times",
    )
    parser.add_argument("--output", type=Path, default=Path("free_regions.png"))
    parser.add_argument("--regions", type=Path, default=Path("free_regions.yaml"))
    parser.add_argument("--width", type=int, default=CAMERA.width, help="of the picture, pixels")
    parser.add_argument("--no-picture", action="store_true", help="only grow and keep them")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Grow, prove, keep and draw."""
    options = parse(arguments)
    query = scene_of(options.scene)
    obstacles = make_iris_obstacles(query)
    print(f"{len(obstacles)} obstacles in {options.scene.name}")
    found: list[IrisRegion] = []
    for number, sample in enumerate(options.sample or SAMPLES, start=1):
        begin = time.perf_counter()
        record = iris(obstacles, sample, ROOM, certificate=True)
        seconds = time.perf_counter() - begin
        proven = sum(s.certificate.verify() for s in record.separations)
        print(
            f"region {number} from {tuple(sample)}: {record.region.calc_volume():.3f} m3,"
            f" {len(record.region.b)} faces, {proven} of {len(record.separations)} obstacles"
            f" proven to be outside, {1e3 * seconds:.0f} ms, {record.reason}"
        )
        found.append(record)
    names = {f"region {number}": r.region for number, r in enumerate(found, start=1)}
    save_iris_regions_yaml_file(options.regions, names)
    print(f"Regions: {options.regions}")
    if not options.no_picture:
        print("Drawing ...", flush=True)
        markers = scene_markers(query)
        for k, record in enumerate(found):
            markers += region_markers(record.region, k)
        height = round(options.width * CAMERA.height / CAMERA.width)
        camera = dataclasses.replace(CAMERA, width=options.width, height=height)
        trace(markers, camera, samples=32).save(options.output)
        print(f"Picture: {options.output}")
    return 0


def scene_of(path: Path) -> QueryObject:
    """Return what the scene is asked by, where all is as it starts."""
    graph = SceneGraph()
    loaded = load_scene(path).apply(graph)
    context = graph.create_default_context()
    loaded.set_initial_poses(context)
    return graph.query_object(context)


def scene_markers(query: QueryObject) -> list[Marker]:
    """Return what people are to see of a scene."""
    inspector, role = query.inspector(), Role.ILLUSTRATION
    arrays = query.snapshot.role_arrays(role)
    scene = SceneMarkers(frame_id="world")
    names = SceneNames(inspector)
    scene.set_items(marker_items(inspector, names, role, arrays.ids.tolist()))
    return list(scene.full(query.snapshot.X_WG_of(role), 0).markers)


def region_markers(region: HPolyhedron, k: int) -> list[Marker]:
    """Return a region as a frame of rods in its own colour."""
    hull = convex_hull(VPolytope(region).vertices)
    corners = np.asarray(hull.vertices)
    color = ColorRGBA(**dict(zip("rgb", COLORS[k % len(COLORS)], strict=True)), a=1.0)
    rods = []
    edges = [(i, int(j)) for i, others in enumerate(hull.neighbors) for j in others if i < j]
    for first, last in edges:
        way = corners[last] - corners[first]
        length = float(np.linalg.norm(way))
        rod = Marker(type=Marker.CYLINDER, color=color, scale=Vector3(x=ROD, y=ROD, z=length))
        # Half the way from z to the rod's direction.
        half = way / length + [0.0, 0.0, 1.0 + 1e-12]
        axis = np.cross([0.0, 0.0, 1.0], half / np.linalg.norm(half))
        x, y, z = (0.5 * (corners[first] + corners[last])).tolist()
        rod.pose.position = Point(x=x, y=y, z=z)
        rod.pose.orientation = Quaternion(
            x=axis[0], y=axis[1], z=axis[2], w=math.sqrt(max(0.0, 1.0 - axis @ axis))
        )
        rods.append(rod)
    return rods


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ConvexSetError, SceneFileError, OSError) as error:
        sys.exit(f"error: {error}")
