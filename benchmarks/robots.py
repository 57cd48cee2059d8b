"""Where links are and how they move: our batches beside pinocchio, one thread each.

``python -m benchmarks.robots`` prints microseconds per configuration and their ratio.
"""

from __future__ import annotations

import numpy as np
import pinocchio

from benchmarks.timing import microseconds
from scene_graph_ros.scene_files import load_kinematic_tree, resolve_resource

__all__ = ["main"]

_ROBOTS = {
    "Panda": "panda_description/urdf/panda.urdf",
    "UR5": "ur_description/urdf/ur5_robot.urdf",
    "Talos": "talos_data/robots/talos_full_v2.urdf",
}
_COUNT = 1000
_REPEATS = 15


def _rows(path: str) -> list[tuple[str, float, float]]:
    """Measure one robot: what, ours, theirs."""
    file = resolve_resource(f"package://example-robot-data/robots/{path}")
    tree = load_kinematic_tree(file)
    model = pinocchio.buildModelFromUrdf(str(file))
    data = model.createData()
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.0, 1.0, (_COUNT, tree.num_positions))
    theirs = [pinocchio.randomConfiguration(model) for _ in range(_COUNT)]
    last, frame = tree.link_names[-1], model.getFrameId(tree.link_names[-1])

    def frames() -> None:
        for each in theirs:
            pinocchio.framesForwardKinematics(model, data, each)

    def jacobians() -> None:
        for each in theirs:
            pinocchio.computeFrameJacobian(
                model, data, each, frame, pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )

    return [
        (
            f"all {len(tree.link_names)} links",
            microseconds(lambda: tree.link_poses(q), _COUNT, _REPEATS),
            microseconds(frames, _COUNT, _REPEATS),
        ),
        (
            "Jacobian of the last",
            microseconds(lambda: tree.jacobians(q, last), _COUNT, _REPEATS),
            microseconds(jacobians, _COUNT, _REPEATS),
        ),
    ]


def main() -> None:
    """Print the table."""
    print(f"{'robot':8} {'what':22} {'ours (us)':>10} {'pinocchio':>10} {'ratio':>7}")
    for name, path in _ROBOTS.items():
        for what, ours, theirs in _rows(path):
            print(f"{name:8} {what:22} {ours:10.2f} {theirs:10.2f} {theirs / ours:7.1f}")


if __name__ == "__main__":
    main()
