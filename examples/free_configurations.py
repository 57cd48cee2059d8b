"""The configurations of an arm of two joints: which are free, who sees whom, and regions of them.

    python examples/free_configurations.py --output free_configurations.png

What collides is dark. Points are random free configurations, lines the edges of their visibility
graph, thick ones those of its largest cliques. Each region is grown around a clique; with its
record, it is tested by points that did not make it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import tempfile

import numpy as np

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.optimization import VPolytope
from scene_graph_ros.planning import (
    iris_in_configuration_space_from_clique_cover,
    IrisFromCliqueCoverOptions,
    IrisZoOptions,
    MaxCliqueSolverViaBranchAndBound,
    MinCliqueCoverSolverViaGreedy,
    RegionCover,
    RobotDiagram,
    SceneGraphCollisionChecker,
    visibility_graph,
)
from scene_graph_ros.scene_files import load_scene_text

LINK = """<collision><origin xyz="0.5 0 0"/><geometry><box size="0.8 0.1 0.1"/></geometry>
  </collision>"""
ARM = f"""<robot name="arm"><link name="base"/><link name="upper">{LINK}</link>
  <link name="lower">{LINK}</link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="1 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint></robot>"""
SCENE = """version: 1
sources: [{{name: around}}]
robots:
  - {{name: arm, urdf: {urdf}}}
geometries:
  - name: ball
    source: around
    pose: {{xyz: [1.2, 0.9, 0]}}
    shape: {{type: sphere, radius: 0.2}}
  - name: box
    source: around
    pose: {{xyz: [-0.9, -0.9, 0]}}
    shape: {{type: box, size: [0.4, 0.4, 0.4]}}
"""


def make_checker() -> SceneGraphCollisionChecker:
    """Return the arm between a ball and a box."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "arm.urdf"
        urdf.write_text(ARM)
        scene_graph = SceneGraph()
        scene = load_scene_text(SCENE.format(urdf=urdf)).apply(scene_graph)
        return SceneGraphCollisionChecker(RobotDiagram.of_scene(scene_graph, scene))


def draw(
    checker: SceneGraphCollisionChecker,
    cover: RegionCover,
    points: np.ndarray,
    graph: np.ndarray,
    cliques: list[set[int]],
    output: Path,
) -> None:
    """Write the picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    tree = checker.model.tree
    x, y = (np.linspace(low, high, 301) for low, high in zip(tree.lower, tree.upper, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    free = checker.check_configs_collision_free(grid).reshape(len(y), len(x))
    figure, panels = pyplot.subplots(1, 2, figsize=(11, 5), layout="constrained", sharey=True)
    for panel in panels:
        extent = (x[0], x[-1], y[0], y[-1])
        panel.imshow(free, cmap="gray", origin="lower", extent=extent, alpha=0.75, vmin=-1.0)
        panel.set_xlabel("shoulder, rad")
    panels[0].set_ylabel("elbow, rad")
    panels[0].set_title("visibility graph, and cliques that cover it")
    panels[1].set_title(
        f"{len(cover.regions)} regions: {100 * cover.coverage:.0f} % of what is free"
    )
    for i, j in np.argwhere(np.triu(graph, 1)):
        panels[0].plot(*points[[i, j]].T, color="0.55", linewidth=0.3)
    colors = pyplot.get_cmap("tab10")
    for k, clique in enumerate(cliques):
        members = sorted(clique)
        for i in members:
            for j in members[members.index(i) + 1 :]:
                panels[0].plot(*points[[i, j]].T, color=colors(k % 10), linewidth=0.9)
    panels[0].plot(*points.T, "k.", markersize=4)
    for k, region in enumerate(cover.regions):
        corners = VPolytope(region).vertices
        middle = corners.mean(axis=0)
        order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
        panels[1].fill(*corners[order].T, facecolor=colors(k % 10), alpha=0.4)
        panels[1].plot(*corners[[*order, order[0]]].T, color=colors(k % 10), linewidth=1.0)
    figure.savefig(output, dpi=110)


def main() -> None:
    """Cover what is free, say how much that is, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("free_configurations.png"))
    parser.add_argument("--no-picture", action="store_true", help="only print what was found")
    arguments = parser.parse_args()
    checker = make_checker()
    tree = checker.model.tree
    points = tree.sample(np.random.default_rng(4), 80)
    points = points[checker.check_configs_collision_free(points)][:40]
    graph = visibility_graph(checker, points)
    solver = MaxCliqueSolverViaBranchAndBound()
    cliques = MinCliqueCoverSolverViaGreedy(solver, 3).solve_min_clique_cover(graph, True)
    print(f"{len(points)} points, {(graph.nnz - len(points)) // 2} edges, {len(cliques)} cliques")
    options = IrisFromCliqueCoverOptions(
        iris_options=IrisZoOptions(max_iterations=1, epsilon=0.02, mixing_steps=20),
        coverage_termination_threshold=0.9,
        num_points_per_visibility_round=60,
        num_points_per_coverage_check=2000,
    )
    cover = iris_in_configuration_space_from_clique_cover(
        checker, options, max_clique_solver=solver, certificate=True
    )
    worst = max(record.share_bound for record in cover.records)
    print(
        f"{len(cover.regions)} regions have {100 * cover.coverage:.1f} % of what is free, in each"
        f" at most {100 * worst:.2f} % collides at 95 %"
    )
    if not arguments.no_picture:
        draw(checker, cover, points, graph.toarray(), cliques, arguments.output)
        print(f"Drawn to {arguments.output}.")


if __name__ == "__main__":
    main()
