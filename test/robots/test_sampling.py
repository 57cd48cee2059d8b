"""Random configurations: within limits, even, and refused where there is no even distribution."""

import numpy as np
import pytest

from scene_graph_ros.robots import KinematicTree, KinematicTreeError
from scene_graph_ros.robots.sampling import rotations
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE


def _tree(*joints: TreeJoint) -> KinematicTree:
    return KinematicTree("robot", joints, ("base",), (0,), np.eye(4)[np.newaxis])


def _joint(name: str, kind: int, lower: float = -np.inf, upper: float = np.inf) -> TreeJoint:
    return TreeJoint(name, kind, 0, np.eye(4), lower=lower, upper=upper)


def test_positions_are_within_limits_and_even():
    """A continuous joint is in [-pi, pi); means are those of even distributions, to 5 sigma."""
    tree = _tree(
        _joint("turns", REVOLUTE), _joint("elbow", REVOLUTE, -1.0, 2.0),
        _joint("slides", PRISMATIC, 0.0, 0.5),
    )  # fmt: skip
    n = 4000
    q = tree.sample(np.random.default_rng(3), n)
    lower, upper = np.array([-np.pi, -1.0, 0.0]), np.array([np.pi, 2.0, 0.5])
    assert q.shape == (n, 3)
    assert (lower <= q).all()
    assert (q < upper).all()
    spread = (upper - lower) / np.sqrt(12.0 * n)
    assert (abs(q.mean(axis=0) - 0.5 * (lower + upper)) < 5.0 * spread).all()
    assert np.array_equal(q, tree.sample(np.random.default_rng(3), n))


def test_rotations_are_even():
    """The mean of w^2, x^2, ... of even unit quaternions is 1/4; the variance of each is 1/16."""
    tree = _tree(_joint("free", FLOATING))
    with pytest.raises(
        KinematicTreeError, match=r"position 'free.x'.*within \[-inf, inf\].*Remedy"
    ):
        tree.sample(np.random.default_rng(0), 1)
    q = rotations(np.random.default_rng(5).random((4000, 3)))
    assert np.allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-15)
    assert (abs((q**2).mean(axis=0) - 0.25) < 5.0 * 0.25 / np.sqrt(4000)).all()
    assert (abs(q.mean(axis=0)) < 5.0 * 0.5 / np.sqrt(4000)).all()


@pytest.mark.parametrize("joint", [_joint("p", PLANAR), _joint("half", PRISMATIC, 0.0)])
def test_what_has_no_even_distribution_is_named(joint):
    """A place without limits, and a position with one."""
    with pytest.raises(KinematicTreeError, match=rf"position '{joint.name}.*Remedy"):
        _tree(joint).sample(np.random.default_rng(0), 2)


@pytest.mark.parametrize(
    ("rng", "n", "said"),
    [
        (3, 1, "rng must be"),
        (None, 1, "rng must be"),
        (np.random.default_rng(0), -1, "n must be"),
        (np.random.default_rng(0), 1.5, "n must be"),
    ],
)
def test_wrong_arguments_are_named(rng, n, said):
    """A seed is no generator, and a number of configurations is whole."""
    with pytest.raises(KinematicTreeError, match=said):
        _tree(_joint("a", REVOLUTE)).sample(rng, n)
