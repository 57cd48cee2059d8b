"""The same edge, sampled and proven: a rod turns through a plate, both thinner than a sample sees.

    python examples/sampled_and_proven.py --output sampled_and_proven.png

On the left the rod from above, where samples look at it. On the right what is between rod and
plate by the angle: points are samples, green is what the proof says is free from either end, and
red is where it says that they collide.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import tempfile

import numpy as np

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.planning import EdgeMeasure, RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import load_scene_text

ROD = """<robot name="rod"><link name="base"/><link name="rod">
  <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.001 0.001"/></geometry></collision>
  </link><joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/>
  <axis xyz="0 0 1"/></joint></robot>"""
ANGLE, LENGTH = 0.52, 0.2
SCENE = f"""version: 1
sources: [{{{{name: around}}}}]
robots:
  - {{{{name: rod, urdf: {{urdf}}}}}}
geometries:
  - name: plate
    source: around
    pose:
      xyz: [{0.8 * math.cos(ANGLE):.9f}, {0.8 * math.sin(ANGLE):.9f}, 0]
      rpy: [0, 0, {ANGLE}]
    shape: {{{{type: box, size: [{LENGTH}, 0.0001, 0.2]}}}}
"""
STEP = 0.05
"""rad, between samples."""


def make_checker() -> SceneGraphCollisionChecker:
    """Return the rod beside the plate, which it meets at an angle of 0.52."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "rod.urdf"
        urdf.write_text(ROD)
        scene_graph = SceneGraph()
        scene = load_scene_text(SCENE.format(urdf=urdf)).apply(scene_graph)
        return SceneGraphCollisionChecker(RobotDiagram.of_scene(scene_graph, scene))


def draw(
    checker: SceneGraphCollisionChecker,
    samples: np.ndarray,
    measures: tuple[EdgeMeasure, EdgeMeasure],
    output: Path,
) -> None:
    """Write the picture; ``measures`` are of the edge from 0 to 1, and back."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (above, along) = pyplot.subplots(1, 2, figsize=(11, 4), layout="constrained")
    hit = float(measures[0].configuration[0])
    for q in samples:
        above.plot([0, math.cos(q)], [0, math.sin(q)], color="0.6", linewidth=0.8)
    above.plot([0, math.cos(hit)], [0, math.sin(hit)], color="tab:red", linewidth=1.5)
    ends = np.array([0.8 - 0.5 * LENGTH, 0.8 + 0.5 * LENGTH])
    above.plot(ends * math.cos(ANGLE), ends * math.sin(ANGLE), color="black", linewidth=2.5)
    above.set_aspect("equal")
    above.set_title(f"{len(samples)} samples of a rod that turns, and a plate: all are free")
    above.set_xlabel("x, m")
    above.set_ylabel("y, m")
    angles = np.unique(np.append(np.linspace(0.0, 1.0, 801), samples))
    kept = [_distance(checker, q) for q in angles]
    along.axvspan(0.0, measures[0].alpha, color="tab:green", alpha=0.2, label="proven free")
    along.axvspan(1.0 - measures[1].alpha, 1.0, color="tab:green", alpha=0.2)
    along.plot(angles, kept, color="0.3", linewidth=1.0)
    along.plot(samples, [_distance(checker, q) for q in samples], "k.", label="samples")
    along.axvline(hit, color="tab:red", linewidth=1.5, label=f"collides at {hit:.4f} rad")
    along.set_title("what is between them")
    along.set_xlabel("angle, rad")
    along.set_ylabel("distance, m")
    along.legend()
    figure.savefig(output, dpi=110)


def _distance(checker: SceneGraphCollisionChecker, q: float) -> float:
    """Return how far rod and plate are apart (m)."""
    return float(checker.calc_robot_clearance([q], 2.0).distances.min())


def main() -> None:
    """Ask samples and the proof, and say what they say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("sampled_and_proven.png"))
    arguments = parser.parse_args()
    checker = make_checker()
    samples = np.linspace(0.0, 1.0, round(1.0 / STEP) + 1)
    free = checker.check_configs_collision_free(samples[:, np.newaxis])
    print(f"{int(free.sum())} of {len(samples)} samples at steps of {STEP} rad are free.")
    there, back = checker.measure_edge([0.0], [1.0]), checker.measure_edge([1.0], [0.0])
    hidden = 1.0 - there.alpha - back.alpha
    print(
        f"The proof: {there.status.name} at {there.configuration[0]:.6f} rad; free up to"
        f" {there.alpha:.6f} and from {1.0 - back.alpha:.6f} on, all but {1e3 * hidden:.2f} mrad."
    )
    draw(checker, samples, (there, back), arguments.output)
    print(f"Drawn to {arguments.output}.")


if __name__ == "__main__":
    main()
