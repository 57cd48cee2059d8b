"""Which configurations see each other, against single edges, in this process and in others."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
import functools
import multiprocessing
import os
import pickle
import signal

import numpy as np
import pytest
from robot_scenes import BALL, diagram, PLATE, ROD, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    load_robot_diagram,
    SceneGraphCollisionChecker,
    UnimplementedCollisionChecker,
    visibility_graph,
)
from scene_graph_ros.planning.checker.carried_checker import pack
from scene_graph_ros.planning.parallel.in_executor import in_executor
from scene_graph_ros.robots import KinematicTreeError

CELL = "config/scenes/panda_cell.yaml"
# Workers that begin as copies of this process have its kernels at once.
POOL = functools.partial(ProcessPoolExecutor, 2, mp_context=multiprocessing.get_context("fork"))


@pytest.fixture(scope="module")
def cell():
    """A Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram(CELL))


def configurations(checker, count, seed=0):
    """Return random configurations within limits."""
    tree = checker.model.tree
    return np.random.default_rng(seed).uniform(tree.lower, tree.upper, (count, tree.num_positions))


def test_a_graph_has_the_edges_that_are_proven(cell):
    """40 points of a Panda, one by one; a point in collision sees nothing, not even itself."""
    q = configurations(cell, 40)
    graph = visibility_graph(cell, q)
    assert graph.dtype == bool and graph.shape == (40, 40) and graph.format == "csc"
    dense = graph.toarray()
    free = cell.check_configs_collision_free(q)
    np.testing.assert_array_equal(dense.diagonal(), free)
    for i in range(40):
        for j in range(i):
            is_seen = free[i] and free[j] and cell.check_edge_collision_free(q[i], q[j])
            assert dense[i, j] == dense[j, i] == is_seen
    assert 0.05 < dense.mean() < 0.95
    for threads in (False, 1, 2):
        assert (visibility_graph(cell, q, threads) != graph).nnz == 0


def test_two_hundred_points_of_a_panda_in_one_go(cell):
    """The graph is symmetric, and no edge of 300 that it has collides at one of 200 samples."""
    q = configurations(cell, 200, seed=1)
    graph = visibility_graph(cell, q, 2)
    assert (graph != graph.T).nnz == 0
    i, j = np.nonzero(np.triu(graph.toarray(), 1))
    chosen = np.random.default_rng(0).choice(len(i), 300, replace=False)
    shares = np.linspace(0.0, 1.0, 200)[:, np.newaxis]
    for row in chosen:
        between = (1.0 - shares) * q[i[row]] + shares * q[j[row]]
        assert cell.check_configs_collision_free(between).all()


def test_samples_miss_what_proofs_find(tmp_path):
    """The rod sweeps over the plate between two samples."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE), edge_step_size=0.4)
    q = [[0.3], [0.69]]
    np.testing.assert_array_equal(visibility_graph(checker, q).toarray(), np.eye(2))
    assert visibility_graph(checker, q, proof=False).toarray().all()


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_points(tmp_path, count):
    """On either side of a ball on the rail, and beyond it alike."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    q = np.array([[0.0], [2.0], [0.5]])[:count]
    graph = visibility_graph(checker, q.reshape(count, 1)).toarray()
    expected = np.eye(3, dtype=bool)
    expected[0, 2] = expected[2, 0] = True
    np.testing.assert_array_equal(graph, expected[:count, :count])
    with POOL() as pool:
        shared = visibility_graph(checker, q.reshape(count, 1), executor=pool).toarray()
    np.testing.assert_array_equal(shared, graph)


def test_processes_and_threads_share_the_work_and_agree(cell):
    """120 points in two shares; paddings go along."""
    checker = cell.clone()
    checker.set_padding_all_robot_environment_pairs(0.02)
    q = configurations(checker, 120, seed=2)
    graph = visibility_graph(checker, q)
    assert graph.diagonal().sum() < cell.check_configs_collision_free(q).sum()
    with ThreadPoolExecutor(2) as pool:
        assert (visibility_graph(checker, q, 1, executor=pool) != graph).nnz == 0
    assert (visibility_graph(checker, q, executor=POOL) != graph).nnz == 0


def test_a_packed_checker_is_small_and_answers_alike(cell):
    """Its bytes are the meshes' hulls; it is unpacked once, and answers bit for bit."""
    packed = pickle.loads(pickle.dumps(pack(cell)))
    assert len(packed.data) < 1_500_000
    other = packed.unpacked()
    assert packed.unpacked() is other
    q = configurations(cell, 100, seed=3)
    free = cell.check_configs_collision_free(q)
    np.testing.assert_array_equal(other.check_configs_collision_free(q), free)
    edges = np.stack([q[:-1], q[1:]], axis=1)
    expected = cell.check_edges_collision_free(edges)
    np.testing.assert_array_equal(other.check_edges_collision_free(edges), expected)


def die_once(path, value):
    """Kill the process that comes first, as a machine that goes down."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return value * value
    return os.kill(os.getpid(), signal.SIGKILL)


def die(value):
    """Kill each process that comes."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_the_share_of_a_killed_worker_is_done_again(tmp_path):
    """By another pool, or by this process with a warning; what kills all pools is told."""
    shares = [(str(tmp_path / "first"), k) for k in range(6)]
    expected = [k * k for k in range(6)]
    assert in_executor(die_once, shares, POOL) == expected
    shares = [(str(tmp_path / "second"), k) for k in range(6)]
    with POOL() as pool, pytest.warns(RuntimeWarning, match="are done by this process"):
        assert in_executor(die_once, shares, pool) == expected
    with pytest.raises(RuntimeError, match="terminated abruptly"):
        in_executor(die, [(1,)], POOL)


def test_what_a_share_raises_is_raised(tmp_path):
    """And the others are dropped."""
    with ThreadPoolExecutor(1) as pool, pytest.raises(ZeroDivisionError):
        in_executor(divmod, [(1, 0), (1, 1)], pool)


class Upright(UnimplementedCollisionChecker):
    """Takes for a collision what is beyond 1."""

    def check_configs_collision_free(self, configurations, *, threads=1):
        return np.abs(np.asarray(configurations)[:, 0]) <= 1.0


def test_checkers_of_ones_own_are_sampled(tmp_path):
    """They are asked in one thread if they say so, and can't be sent away as they are."""
    robots = diagram(tmp_path, SLIDE)
    own = Upright(model=robots, supports_parallel_checking=False)
    graph = visibility_graph(own, [[0.0], [0.9], [1.1]], 8).toarray()
    np.testing.assert_array_equal(graph, [[1, 1, 0], [1, 1, 0], [0, 0, 0]])
    with POOL() as pool, pytest.raises(CollisionCheckerError, match="Upright can't be sent"):
        visibility_graph(own, [[0.0], [0.9]], executor=pool)


@pytest.mark.parametrize(
    ("points", "options", "error", "message"),
    [
        ([[0.0, 1.0]], {}, KinematicTreeError, "shape"),
        ([[np.nan]], {}, KinematicTreeError, "finite"),
        ([[1e200]], {}, CollisionCheckerError, "beyond"),
        ([[0.0]], {"parallelize": 0}, CollisionCheckerError, "parallelize"),
        ([[0.0]], {"parallelize": "all"}, CollisionCheckerError, "parallelize"),
        ([[0.0]], {"executor": 3}, CollisionCheckerError, "executor"),
        ([[0.0], [1.0]], {"executor": dict}, CollisionCheckerError, "executor must make"),
        ([[0.0]], {"executor": POOL, "proof": False}, CollisionCheckerError, "proof=False"),
    ],
)
def test_bad_input_is_refused(tmp_path, points, options, error, message):
    """Naming the argument."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE))
    with pytest.raises(error, match=message):
        visibility_graph(checker, points, **options)
