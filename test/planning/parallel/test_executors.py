"""Work that is shared out: the same results from dask's workers on this machine as from none."""

from concurrent.futures import Executor, Future, ProcessPoolExecutor
import functools
import heapq
import multiprocessing
import os
import signal
import time

from distributed import Client, LocalCluster
import numpy as np
import pytest
from robot_scenes import ARM, diagram, POSTS

from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning import (
    build_roadmap,
    iris_in_configuration_space_from_clique_cover,
    IrisFromCliqueCoverOptions,
    IrisZoOptions,
    load_robot_diagram,
    plan_path,
    PlanningError,
    regions_along,
    regions_around,
    SceneGraphCollisionChecker,
    visibility_graph,
)
from scene_graph_ros.planning.edges.edge_proofs import prove
from scene_graph_ros.planning.paths.search.path_search import search_rules
from scene_graph_ros.planning.regions.feasibility import Feasibility

CELL = "config/scenes/panda_cell.yaml"
ZO = IrisZoOptions(max_iterations=1, num_particles=500)
QUICK = IrisZoOptions(max_iterations=1, num_particles=200, mixing_steps=10)
DOMAIN = HPolyhedron.make_box([-3.0, -2.8], [3.0, 2.8])
HOME = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
# Workers that begin as copies of this process have its kernels at once.
POOL = functools.partial(ProcessPoolExecutor, 2, mp_context=multiprocessing.get_context("fork"))


@pytest.fixture(scope="module")
def cell():
    """A Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram(CELL))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


@pytest.fixture(scope="module")
def client():
    """Two workers of dask, a process each."""
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


class Passing(Executor):
    """Passes work on to another executor, and tells who watches how much of it there was."""

    def __init__(self, other, watch):
        self.other, self.watch, self.count = other, watch, 0

    def submit(self, function, /, *arguments, **named):
        """Pass it on."""
        future = self.other.submit(function, *arguments, **named)
        self.count += 1
        self.watch(self.count)
        return future


def makespan(efforts, workers):
    """Return when so many workers end that take shares one by one."""
    busy_until = [0.0] * workers
    for effort in efforts:
        heapq.heapreplace(busy_until, busy_until[0] + effort)
    return max(busy_until)


class Noting(Executor):
    """Does the work at once, and notes how much each share was."""

    def __init__(self, looks):
        self.looks, self.efforts = looks, []

    def submit(self, function, /, *arguments):
        """Do it, and note the effort."""
        future = Future()
        future.set_result(function(*arguments))
        self.efforts.append(self.looks(function, arguments))
        return future

    def speedup(self, workers):
        """Return how much sooner so many workers end; the first free one takes a share."""
        return sum(self.efforts) / makespan(self.efforts, workers)


def configurations(checker, count, seed=0):
    """Return random configurations within limits."""
    tree = checker.model.tree
    return np.random.default_rng(seed).uniform(tree.lower, tree.upper, (count, tree.num_positions))


def same_roadmaps(one, other):
    """Tell whether two roadmaps are the same, bit for bit."""
    return (
        np.array_equal(one.configurations, other.configurations)
        and one.num_proven_edges == other.num_proven_edges
        and all(map(np.array_equal, one.edge_table(), other.edge_table()))
    )


def test_dask_has_the_same_graphs_roadmaps_and_regions(client, cell, arm):
    """All that takes an executor, on two workers that have started anew."""
    executor = client.get_executor()
    q = configurations(cell, 40)
    graph = visibility_graph(cell, q)
    assert (visibility_graph(cell, q, 1, executor=executor) != graph).nnz == 0
    roadmap = build_roadmap(cell, HOME, 40, group="arm")
    assert 0 < roadmap.num_proven_edges < roadmap.edges
    assert same_roadmaps(build_roadmap(cell, HOME, 40, group="arm", executor=executor), roadmap)
    options = IrisFromCliqueCoverOptions(iteration_limit=1, iris_options=ZO)
    regions, shared = (
        iris_in_configuration_space_from_clique_cover(arm, options, domain=DOMAIN, executor=each)
        for each in (None, executor)
    )
    assert len(regions) == len(shared) > 0
    along, shared_along = (
        regions_along(arm, [[-1.5, 0.4], [0.0, 0.0], [0.0, 1.0]], DOMAIN, ZO, executor=each)
        for each in (None, executor)
    )
    assert len(along) == len(shared_along) > 0
    seeds = [[-1.5, 0.4], [[0.0, 0.0], [0.0, 1.0]], [2.0, 0.3]]
    around, shared_around = (
        regions_around(arm, seeds, DOMAIN, ZO, executor=each) for each in (None, executor)
    )
    assert len(around) == len(shared_around) == 3
    along, shared_along = [*along, *around], [*shared_along, *shared_around]
    regions += [each.region for each in along]
    shared += [each.region for each in shared_along]
    for one, other in zip(regions, shared, strict=True):
        np.testing.assert_array_equal(one.A, other.A)
        np.testing.assert_array_equal(one.b, other.b)


def test_dask_does_the_share_of_a_killed_worker_again(client, cell):
    """A worker is killed that has something to do; what it had is done by others."""
    q = configurations(cell, 60, seed=1)
    expected = visibility_graph(cell, q)
    processes = client.run(os.getpid)
    victim, other = processes

    def kill(count):
        if count != 4:
            return
        deadline = time.monotonic() + 60
        while not client.processing()[victim]:
            assert time.monotonic() < deadline
        os.kill(processes[victim], signal.SIGKILL)
        os.kill(processes[other], signal.SIGCONT)

    # While both stand still the first shares are sent to both, and none is done.
    for process in processes.values():
        os.kill(process, signal.SIGSTOP)
    executor = Passing(client.get_executor(), kill)
    graph = visibility_graph(cell, q, 1, executor=executor)
    assert (graph != expected).nnz == 0
    assert executor.count > 4
    # The scheduler may take a while to notice, and asks the dead until then.
    deadline = time.monotonic() + 120
    while len(found := client.run(os.getpid, on_error="ignore")) != 2 or (
        processes[victim] in found.values()
    ):
        assert time.monotonic() < deadline, found
        time.sleep(0.1)


def test_a_pool_has_the_same_roadmap_and_paths_through_it(cell):
    """Paths know what was proven beforehand."""
    roadmap = build_roadmap(cell, HOME, 150, group="arm", seed=3)
    shared = build_roadmap(cell, HOME, 150, group="arm", seed=3, parallelize=1, executor=POOL)
    assert same_roadmaps(shared, roadmap)
    other = build_roadmap(cell, HOME, 150, group="arm", seed=4)
    assert not np.array_equal(other.configurations, roadmap.configurations)
    assert (roadmap.configurations[:, -1] == HOME[-1]).all()
    assert cell.check_configs_collision_free(roadmap.configurations).all()
    goal = HOME + np.array([1.8, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    known = roadmap.edges
    paths = [
        plan_path(cell, HOME, goal, planner="prm", group="arm", roadmap=each, timeout=60)
        for each in (roadmap, shared)
    ]
    assert all(path.is_success for path in paths)
    np.testing.assert_array_equal(*(path.configurations for path in paths))
    # No edge between those of before was looked at again: only those of start and goal.
    ends = roadmap.edge_table()[0][known:]
    assert len(ends) > 0 and (ends.max(axis=1) >= 150).all()


def test_shares_keep_workers_busy(cell):
    """As many looks as all workers together can have in the time in which they end, nearly.

    A look is one at a stretch of an edge: what proofs consist of.
    """
    rules = search_rules(cell.tolerance)

    def looks(function, arguments):
        # Of a graph's share that is numbers of pairs; of a roadmap's the edges themselves.
        if function.__name__ == "_visible":
            _, q, first, last, *_ = arguments
            i, j = (each[first:last] for each in np.triu_indices(len(q), 1))
            edges = np.stack([q[i], q[j]], axis=1)
        else:
            edges = arguments[1]
        return float(prove(cell.plan, edges, rules).numbers[:, 3].sum())

    q = configurations(cell, 130, seed=2)
    for what, work in {
        "graph": lambda executor: visibility_graph(cell, q, 1, executor=executor),
        "roadmap": lambda executor: build_roadmap(
            cell, HOME, 250, parallelize=1, executor=executor
        ),
    }.items():
        noting = Noting(looks)
        work(noting)
        found = {workers: noting.speedup(workers) for workers in (2, 4, 8, 16)}
        print(what, len(noting.efforts), {key: round(value, 2) for key, value in found.items()})
        for workers, speedup in found.items():
            assert speedup > (0.95 if workers < 8 else 0.8) * workers


@pytest.fixture
def growth(monkeypatch):
    """How much growing a share takes: how many configurations are asked about.

    A point of a region is walked to and then asked about, so that is what growing consists of.
    """
    asked = [0]
    free = Feasibility.free

    def counted(self, q):
        asked[0] += len(q)
        return free(self, q)

    def looks(function, arguments):
        effort, asked[0] = asked[0], 0
        return float(effort)

    monkeypatch.setattr(Feasibility, "free", counted)
    return looks


def test_regions_around_seeds_keep_workers_busy(arm, growth):
    """As graphs and roadmaps do, around 96 seeds."""
    q = configurations(arm, 400, seed=3)
    seeds = q[arm.check_configs_collision_free(q)][:96]
    noting = Noting(growth)
    assert len(regions_around(arm, seeds, DOMAIN, QUICK, executor=noting)) == 96
    # The seeds themselves are asked about before, by who shares out.
    assert len(noting.efforts) == 96
    found = {workers: noting.speedup(workers) for workers in (2, 4, 8, 16)}
    print({key: round(value, 2) for key, value in found.items()})
    for workers, speedup in found.items():
        assert speedup > (0.9 if workers < 16 else 0.8) * workers


@pytest.mark.parametrize("pieces", [1, 12])
def test_regions_along_a_path_keep_workers_busy(arm, growth, pieces):
    """Beside one worker that grows just the regions that are needed.

    Edges of a path need a region each, as shortcuts were taken. Where each edge comes in pieces
    few do, one after another: then four workers take hardly longer than one, as few others grow.
    """
    tour, rng = [np.array([-1.5, 0.4])], np.random.default_rng(5)
    while len(tour) <= 96 // pieces:
        goal = rng.uniform([-2.5, -2.0], [2.5, 2.0])
        plan = plan_path(arm, tour[-1], goal) if arm.check_config_collision_free(goal) else None
        if plan is not None and plan.is_success:
            tour += list(plan.configurations[1:])
    tour = tour[: 96 // pieces + 1]
    places = np.linspace(0.0, len(tour) - 1.0, pieces * (len(tour) - 1) + 1)
    path = np.stack(
        [np.interp(places, np.arange(len(tour)), column) for column in np.transpose(tour)], axis=1
    )
    waves = []

    def make():
        waves.append(Noting(growth))
        return waves[-1]

    regions = regions_along(arm, path, DOMAIN, QUICK, executor=make)
    growth(None, None)
    alone = regions_along(arm, path, DOMAIN, QUICK)
    needed = growth(None, None)
    assert len(alone) == len(regions)
    done = sum(sum(wave.efforts) for wave in waves)
    found = {
        workers: needed / sum(makespan(wave.efforts, workers) for wave in waves)
        for workers in (2, 4, 8, 16)
    }
    shares = [len(wave.efforts) for wave in waves]
    shown = {key: round(value, 2) for key, value in found.items()}
    print(len(path) - 1, len(regions), shares, round(done / needed, 2), shown)
    if pieces == 1:
        assert shares == [96]
        for workers, speedup in found.items():
            assert speedup > (0.8 if workers < 16 else 0.7) * workers
    else:
        assert sum(shares) < 3 * len(regions) < 48
        assert found[4] > 0.7


def test_what_makes_no_sense_is_refused(arm, tmp_path):
    """Errors name the argument and the value."""
    for arguments, words in (
        ({"count": 0}, "count .* 0"),
        ({"count": 1.5}, "count"),
        ({"seed": -1}, "seed"),
        ({"q": [[0.0, 0.0]]}, "q must have shape"),
    ):
        with pytest.raises(PlanningError, match=words):
            build_roadmap(arm, **{"q": [0.0, 0.0], "count": 5} | arguments)
    blocked = arm.clone()
    blocked.set_padding_all_robot_environment_pairs(9.0)
    with pytest.raises(PlanningError, match="0 of 500 random configurations are free"):
        build_roadmap(blocked, [0.0, 0.0], 5)
