"""Messages of sensors looked at beside the updates: the same points, some updates later."""

import threading

from looking_arm import ahead, Looking, NOW, SECOND
import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryFrame
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.sensor_worker import SensorWorker, ToldWorker

MS = 1_000_000


@pytest.fixture
def looking(tmp_path):
    """Return a world whose images are looked at when its ``worker`` is told to."""
    looking = Looking(tmp_path)
    looking.worker = ToldWorker()
    looking.images.look_in(looking.worker)
    looking.turn(0.0, NOW - 100 * MS)
    looking.turn(1.0, NOW)
    return looking


def test_points_come_later_and_are_those_of_the_stamp(looking, tmp_path):
    """The arm has moved on by then; what is seen is the same as without waiting."""
    assert not looking.send(stamp=NOW - 50 * MS)
    assert "camera" not in looking.world.snapshot.images
    looking.now += 50 * MS
    looking.turn(2.0, NOW + 50 * MS)
    assert not looking.update()
    looking.worker.finish()
    assert looking.update()
    np.testing.assert_allclose(looking.middle(), ahead(0.5), atol=1e-9)
    assert looking.world.snapshot.source_stamp("camera") == NOW - 50 * MS
    other = Looking(tmp_path)
    other.turn(0.0, NOW - 100 * MS)
    other.turn(1.0, NOW)
    assert other.send(stamp=NOW - 50 * MS)
    np.testing.assert_array_equal(looking.points(), other.points())
    assert looking.faults() == {}


def test_while_one_is_looked_at_others_wait_and_few_of_them_are_kept(looking):
    """Then the newest whose poses are there is next; no queue grows."""
    for k in range(12):
        assert not looking.send(stamp=NOW - 90 * MS + k * MS)
    assert looking.intake.statistics.superseded == 12 - 1 - looking.images.queued
    looking.worker.finish()
    assert looking.update()
    assert looking.world.snapshot.source_stamp("camera") == NOW - 90 * MS
    looking.now += 200 * MS
    looking.turn(1.0, NOW + 200 * MS)
    assert not looking.send(stamp=NOW + 100 * MS)
    looking.worker.finish()
    assert looking.update()
    assert looking.world.snapshot.source_stamp("camera") == NOW + 100 * MS
    assert looking.faults() == {}


def test_points_expire_also_while_a_message_is_looked_at(looking):
    """The look began with points that are too old when it ends."""
    assert not looking.send(stamp=NOW)
    looking.worker.finish()
    assert looking.update()
    looking.now = NOW + 2900 * MS
    looking.turn(1.0, NOW + 2900 * MS)
    assert not looking.send(stamp=NOW + 2900 * MS, depth=np.full((3, 3), np.nan))
    assert len(looking.points()) > 0
    looking.now = NOW + 3 * SECOND + 1
    assert looking.update()
    assert len(looking.points()) == 0
    looking.worker.finish()
    assert looking.update()
    assert len(looking.points()) == 0


def test_a_message_of_another_scene_is_looked_at_again(looking):
    """An edit meanwhile may have changed the robot, or what there is to fill."""
    assert not looking.send(stamp=NOW - 50 * MS)
    source = looking.world.records["load"].id
    looking.world.edit(
        lambda edit: edit.scene_graph.register_frame(source, GeometryFrame("another"))
    )
    looking.worker.finish()
    assert not looking.update()
    looking.worker.finish()
    assert looking.update()
    np.testing.assert_allclose(looking.middle(), ahead(0.5), atol=1e-9)


def test_a_clock_that_jumps_back_forgets_the_look(looking):
    """Its stamp is from before; later messages count."""
    assert not looking.send(stamp=NOW)
    with looking.world.lock:
        looking.world.forget_stamps(UNSTAMPED)
    looking.worker.finish()
    assert not looking.update()
    assert looking.intake.statistics.superseded == 1
    looking.now = NOW - SECOND
    looking.turn(0.0, NOW - SECOND)
    assert not looking.send(stamp=NOW - SECOND)
    looking.worker.finish()
    assert looking.update()
    assert looking.world.snapshot.source_stamp("camera") == NOW - SECOND


def test_a_look_that_fails_is_counted_and_the_next_one_begins(looking, monkeypatch):
    """As if it had been looked at in the update."""
    from scene_graph_ros.geometry.errors import SceneGraphError

    def refuse(*arguments):
        raise SceneGraphError("no view")

    monkeypatch.setattr(looking.images, "_view", refuse)
    assert not looking.send(stamp=NOW - 50 * MS)
    looking.worker.finish()
    assert not looking.update()
    assert looking.faults() == {Fault.MALFORMED: 1}
    monkeypatch.undo()
    assert not looking.send(stamp=NOW)
    looking.worker.finish()
    assert looking.update()


def test_an_image_between_two_joint_states_of_one_update_has_its_place(tmp_path):
    """The first that were ever heard, and later ones: each is a moment."""
    looking = Looking(tmp_path)
    looking.turn(0.2, NOW - 100 * MS, updates=False)
    looking.turn(0.6, NOW, updates=False)
    assert looking.send(stamp=NOW - 50 * MS)
    np.testing.assert_allclose(looking.middle(), ahead(0.4), atol=1e-9)
    looking.now += 300 * MS
    looking.turn(2.0, NOW + 100 * MS, updates=False)
    looking.turn(0.0, NOW + 200 * MS, updates=False)
    looking.turn(1.0, NOW + 300 * MS, updates=False)
    assert looking.send(stamp=NOW + 150 * MS)
    np.testing.assert_allclose(looking.middle(), ahead(1.0), atol=1e-9)
    assert looking.faults() == {}


def test_the_workers_thread_is_another_one():
    """It begins with the first message, tells when it is done, and ends."""
    told = threading.Event()
    worker = SensorWorker(told.set)
    worker.close()
    future = worker.start(threading.get_ident)
    assert future.result(timeout=10.0) != threading.get_ident()
    assert told.wait(timeout=10.0)
    failed = worker.start(lambda: 1 // 0)
    assert isinstance(failed.exception(timeout=10.0), ZeroDivisionError)
    worker.close()
