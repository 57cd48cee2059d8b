"""Dispatchers are made when kernels are first used, whoever has them, and are then numba's own."""

from concurrent.futures import ThreadPoolExecutor
import signal
import subprocess
import sys
import threading
import time

import numba
import numba.core.config
from numba.core.registry import CPUDispatcher
import pytest

from scene_graph_ros.geometry.compiled.kernel import compilation_count, kernel
from scene_graph_ros.geometry.compiled.lazy_dispatcher import LazyDispatcher

pytestmark = pytest.mark.skipif(
    bool(numba.core.config.DISABLE_JIT), reason="there are no dispatchers without numba's compiler"
)

_CODE = """
import gc
import scene_graph_ros.geometry, scene_graph_ros.geometry.query.point.ask
from scene_graph_ros.geometry.compiled.lazy_dispatcher import LazyDispatcher
from numba.core.registry import CPUDispatcher
made = [each for each in gc.get_objects() if type(each) is CPUDispatcher]
declared = [each for each in gc.get_objects() if type(each) is LazyDispatcher]
ours = [each for each in made if each.py_func.__module__.startswith("scene_graph_ros")]
print(len(declared), len(ours))
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    """Place the cache in a folder of the test's own."""
    monkeypatch.setenv("SCENE_GRAPH_ROS_KERNEL_CACHE", str(tmp_path / "cache"))


def _twice(x):
    return 2.0 * x


def _is_made(dispatcher):
    return type(dispatcher) is CPUDispatcher


def test_an_import_makes_no_dispatcher():
    """Hundreds of kernels are declared, and numba has been asked for none of them."""
    command = [sys.executable, "-c", _CODE]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    declared, made = map(int, done.stdout.split())
    assert declared > 500
    assert made == 0


def test_a_declared_kernel_tells_what_it_is_of():
    """Its class, function and text make no dispatcher, and are those of the one that is made."""
    declared = kernel(_twice)
    text = repr(declared)
    assert isinstance(declared, CPUDispatcher)
    assert declared.py_func is _twice
    assert type(declared) is LazyDispatcher
    assert declared.overloads == {}
    assert _is_made(declared)
    assert declared.py_func is _twice
    assert repr(declared) == text == repr(numba.njit(_twice))
    assert set(vars(declared)) >= set(vars(numba.njit(_twice)))
    assert not {"_initialize", "_is_being_made"} & set(vars(declared))


def test_its_first_call_makes_it_for_whoever_has_it():
    """The object is the same before and after."""
    declared = kernel(_twice)
    held = [declared]
    before = compilation_count()
    assert declared(3.0) == held[0](3.0) == 6.0
    assert _is_made(held[0])
    assert compilation_count() == before + 1


def test_a_call_from_another_kernel_makes_it():
    """It is compiled for its caller alone."""
    inner = kernel(_twice)

    @kernel
    def outer(x):
        return inner(x) + 1.0

    assert outer(3.0) == 7.0
    assert _is_made(inner)
    assert len(inner.callees.results) == 1
    assert not inner.overloads


def test_a_function_of_numba_alone_may_call_it():
    """A kernel is to others what numba's own dispatchers are."""
    inner = kernel(_twice)
    assert numba.njit(lambda x: inner(x) + 1.0)(3.0) == 7.0
    assert _is_made(inner)


def test_an_attribute_that_is_set_stays():
    """The dispatcher is made first, which would set it anew."""
    declared = kernel(_twice)
    declared.doc = "of another"
    assert _is_made(declared)
    assert declared.doc == "of another"


def test_threads_get_the_whole_dispatcher():
    """One of them makes it, and the others wait for that."""
    begin, made = threading.Barrier(8), []

    def initialize(dispatcher):
        made.append(threading.get_ident())
        CPUDispatcher.__init__(dispatcher, _twice, targetoptions={"nopython": True})
        time.sleep(0.05)
        dispatcher.whole = True

    declared = LazyDispatcher(_twice, initialize)

    def ask(number):
        begin.wait()
        return declared.whole if number % 2 else declared(float(number))

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(ask, range(8))) == [0.0, True, 4.0, True, 8.0, True, 12.0, True]
    assert len(made) == 1


def test_a_signal_does_not_reach_what_makes_it():
    """Ctrl-C leaves the first use at once; the next one waits for the whole dispatcher."""
    made, left = [], threading.Event()

    def initialize(dispatcher):
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        assert left.wait(60.0)
        CPUDispatcher.__init__(dispatcher, _twice, targetoptions={"nopython": True})
        made.append(dispatcher)

    declared = LazyDispatcher(_twice, initialize)
    with pytest.raises(KeyboardInterrupt):
        declared(1.0)
    assert not made
    left.set()
    assert declared(1.0) == 2.0
    assert made == [declared]
