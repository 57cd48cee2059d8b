"""Certify that an arm of two joints collides with nothing in a region, and grow the region.

    .venv/bin/python examples/certified_regions.py --output certified.png

A box of configurations is proven free by planes between geometries, and grows from proof to proof.
Each proof is checked in rational numbers. The last region is proven again by distances alone. The
picture has the regions among all configurations on the left, and on the right the arm in
configurations of the last one, between what it must not touch.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys
import tempfile
import time

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.planning import (
    BilinearAlternationOptions,
    CspaceFreePolytope,
    PolytopeCertificate,
    RobotDiagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.scene_files import load_scene_text

LENGTH, WIDTH = 1.0, 0.1
"""Of a link, m."""
BALL, RADIUS = (1.2, 0.9), 0.2
BOX, SIDE = (-0.9, -0.9), 0.4
"""Where a ball and a box stand in the plane, and how large they are, m."""
HALF = 0.1
"""Half of the first region's width, in s = tan(q / 2)."""
GRID, POSES = 300, 60
"""Configurations along each axis of the picture, and arms that are drawn."""

LINK = f"""<link name="link{{k}}"><collision><origin xyz="{LENGTH / 2} 0 0"/><geometry>
<box size="{0.8 * LENGTH} {WIDTH} {WIDTH}"/></geometry></collision></link>
<joint name="joint{{k}}" type="revolute"><parent link="link{{before}}"/><child link="link{{k}}"/>
<origin xyz="{{x}} 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint>"""
URDF = (
    '<robot name="arm"><link name="link0"/>'
    + "".join(LINK.format(k=k, before=k - 1, x=LENGTH * (k > 1)) for k in (1, 2))
    + "</robot>"
)
SCENE = f"""
version: 1
sources: [{{name: around}}]
robots: [{{name: arm, urdf: URDF}}]
geometries:
  - {{name: ball, source: around, pose: {{xyz: [{BALL[0]}, {BALL[1]}, 0]}},
      shape: {{type: sphere, radius: {RADIUS}}}}}
  - {{name: box, source: around, pose: {{xyz: [{BOX[0]}, {BOX[1]}, 0]}},
      shape: {{type: box, size: [{SIDE}, {SIDE}, {SIDE}]}}}}
"""


def arm() -> SceneGraphCollisionChecker:
    """Return the arm between a ball and a box; its links, which meet, are no pair."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(URDF)
        graph = SceneGraph()
        scene = load_scene_text(SCENE.replace("URDF", str(path))).apply(graph)
    checker = SceneGraphCollisionChecker(RobotDiagram.of_scene(graph, scene))
    checker.set_collision_filtered_between("link1", "link2", True)
    return checker


def draw(
    output: Path, checker: SceneGraphCollisionChecker, found: list[PolytopeCertificate]
) -> None:
    """Write the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import patches, pyplot

    q = np.linspace(-2.8, 2.8, GRID)
    grid = np.stack(np.meshgrid(q, q), axis=-1).reshape(-1, 2)
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10.0, 5.0), layout="constrained")
    is_free = np.array(checker.check_configs_collision_free(grid), dtype=bool)
    left.contourf(q, q, ~is_free.reshape(GRID, GRID), levels=[0.5, 1.5], colors=["0.6"])
    for k, each in enumerate(found):
        inside = each.contains(grid).reshape(GRID, GRID)
        left.contour(q, q, inside, levels=[0.5], colors=[pyplot.get_cmap("viridis")(k / 5)])
    left.set(xlabel="shoulder, rad", ylabel="elbow, rad", aspect="equal")
    left.set_title("grey: collisions; lines: proven regions, as they grow", fontsize=10)
    inside = grid[found[-1].contains(grid)]
    chosen = inside[np.linspace(0, len(inside) - 1, POSES).astype(int)]
    for shoulder, elbow in chosen:
        ends = _ends(shoulder, elbow)
        right.plot(*ends.T, color="tab:blue", alpha=0.25, lw=4, solid_capstyle="round")
    right.add_patch(patches.Circle(BALL, RADIUS, color="tab:red"))
    corner = BOX[0] - SIDE / 2, BOX[1] - SIDE / 2
    right.add_patch(patches.Rectangle(corner, SIDE, SIDE, color="tab:red"))
    right.set(xlabel="x, m", ylabel="y, m", xlim=(-1.3, 2.2), ylim=(-2.1, 1.4), aspect="equal")
    right.set_title("the arm in the last region", fontsize=10)
    figure.savefig(output, dpi=100)


def _ends(shoulder: float, elbow: float) -> NDArray[np.float64]:
    """Return shoulder, elbow and tip in the plane, m."""
    turns = np.array([shoulder, shoulder + elbow])
    steps = LENGTH * np.column_stack([np.cos(turns), np.sin(turns)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def main(arguments: list[str] | None = None) -> int:
    """Certify, grow, check and draw; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=4, help="how often the region grows")
    parser.add_argument("--output", type=Path, default=Path("certified.png"), help="the picture")
    options = parser.parse_args(arguments)
    checker = arm()
    search = CspaceFreePolytope(checker)
    C, d = np.concatenate([np.eye(2), -np.eye(2)]), np.full(4, HALF)
    begin = time.perf_counter()
    chosen = BilinearAlternationOptions(max_iter=options.rounds)
    found = search.search_with_bilinear_alternation(C, d, options=chosen)
    if not found:
        print("the first region was not proven")
        return 1
    print(f"{len(found)} regions in {time.perf_counter() - begin:.2f} s:")
    for each in found:
        volume = each.certified_polytope.calc_volume()
        words = "holds" if each.verify() else "does not hold"
        print(f"  area {volume:.3f} of s, {1e3 * each.distance:.1f} mm kept; the proof {words}")
    last = found[-1].certified_polytope
    begin = time.perf_counter()
    again = search.certify_by_distances(last.A, last.b)
    print(
        f"By distances the last one is {again.status}, with {again.num_boxes} boxes in"
        f" {1e3 * (time.perf_counter() - begin):.1f} ms."
    )
    draw(options.output, checker, found)
    print(f"Drawn to {options.output}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
