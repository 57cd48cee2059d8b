"""Requests with odd fields: a status that says why, and nothing has changed where refused."""

from __future__ import annotations

from copy import deepcopy
import os
from pathlib import Path
import random
from typing import Any

from fuzzing import fuzz, Target
import pytest
from service_requests import (
    camera_requests,
    geometry_queries,
    planning_requests,
    region_requests,
    scene_edits,
)
from service_requests.odd_fields import anything, assert_finite, fields
from service_requests.small_world import new_world, state
from service_requests.without_node import ask, Host, offer

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_ros.node.services.queries import QUERIES
from scene_graph_ros.node.world.edits import EDITS

KINDS = (geometry_queries, scene_edits, camera_requests, region_requests, planning_requests)

VALID: dict[str, dict[str, Any]] = {
    name: each for kind in KINDS for name, each in kind.REQUESTS.items()
}
"""Good requests, but those that are about surfaces: their kernels take minutes.

A name is that of the type; where there are several of one, words after it tell them apart.
"""

LEFT_OUT = {"ComputeContactSurfaces", "ComputeDeformableContact"}


def type_of(name: str) -> str:
    """Return the type of a request by its name."""
    return name.split(maxsplit=1)[0]


def make(rng: random.Random) -> list[Any]:
    """Return requests in a row: each a type, and fields that are not as in the good one."""
    steps = []
    for _ in range(rng.choice([1, 1, 2, 4])):
        name = rng.choice(list(VALID))
        places = fields(request_of(name, []))
        chosen = rng.sample(places, min(rng.choice([0, 1, 1, 2, 3]), len(places)))
        changes = [(place, anything(rng, kind)) for place, kind in chosen]
        steps.append((name, [change for change in changes if change[1] is not None]))
    return steps


def request_of(name: str, changes: list[Any]) -> Any:
    """Return a good request with some fields changed."""
    kind = type_of(name)
    kind = PlanPath.Goal if kind == "PlanPath" else getattr(scene_graph_msgs.srv, kind).Request
    request = kind(**deepcopy(VALID[name]))
    for place, value in sorted(changes, key=lambda change: -len(change[0])):
        *way, last = place
        target = request
        for part in way:
            target = target[part] if isinstance(part, int) else getattr(target, part)
        setattr(target, last, value)
    return request


def run(steps: list[Any]) -> None:
    """Ask, and look at the answers and at what is left of the scene."""
    world, host = new_world(), Host()
    services = offer(world, host)
    for name, changes in steps:
        request = request_of(name, changes)
        before = state(world)
        response = ask(services, type_of(name), request)
        assert response.status.code != Status.INTERNAL_ERROR, host.failures
        if response.status.code == Status.OK:
            assert_finite(response)
            continue
        assert response.status.message.strip()
        assert len(response.status.message) < 20_000
        assert state(world) == before
    assert ask(services, "HasCollisions", request_of("HasCollisions", [])).status.code in (
        Status.OK,
        Status.UNSUPPORTED_PAIR,
    )


def test_every_service_is_tried() -> None:
    """And the action; but those about surfaces, and the list of effects, which asks nothing."""
    assert {type_of(name) for name in VALID} == ({*QUERIES, *EDITS} - LEFT_OUT) | {"PlanPath"}


@pytest.mark.parametrize("name", VALID)
def test_good_requests_are_answered(name):
    """What the fuzzer starts from is right, so that it gets behind the first check.

    Paths are found, so that it gets behind the search, too.
    """
    world, host = new_world(), Host()
    host.values["max_planning_time"] = 60.0  # nothing is refused for being late
    response = ask(offer(world, host), type_of(name), request_of(name, []))
    assert response.status.code == Status.OK, (response.status, host.failures)
    if type_of(name) == "PlanPath":
        assert response.failure == PlanPath.Result.NONE, response.reason
        assert len(host.plans) == 1 and len(response.trajectory.points) > 1


@pytest.mark.parametrize("kind", ["fifo", "device", "sparse", "deep", "long", "missing"])
@pytest.mark.parametrize("name", ["LoadScene", "RegisterGeometry"])
def test_files_that_never_end_are_invalid(tmp_path, name, kind):
    """A pipe, a device, 40 GB, a bomb and a name of 100 000 characters are INVALID_ARGUMENT."""
    path, words = tmp_path / "scene.obj", "no such file"
    if kind == "fifo":
        os.mkfifo(path)
        words = "no regular file"
    elif kind == "device":
        path, words = Path("/dev/zero"), "no regular file"
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(40 * 2**30)
        words = "has 42949672960 bytes, the limit is"
    elif kind == "deep":
        path.write_text("[" * 2000)
        words = "100 deep" if name == "LoadScene" else "no vertices"
    resource = "a" * 100_000 if kind == "long" else str(path)
    words = "at most 4096 characters, got 100000" if kind == "long" else words
    place = ("resource",) if name == "LoadScene" else ("geometries", 0, "shape", "resource")
    changes: list[Any] = [(place, resource)]
    if name == "LoadScene":
        changes.append((("text",), ""))
    if name == "RegisterGeometry":
        changes += [((*place[:-1], "kind"), 7), ((*place[:-1], "dimensions"), [])]
    world, host = new_world(), Host()
    before = state(world)
    response = ask(offer(world, host), type_of(name), request_of(name, changes))
    assert response.status.code == Status.INVALID_ARGUMENT, response.status
    assert words in response.status.message
    assert state(world) == before


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_requests_with_odd_fields():
    """Each answer is finite or has a status with a reason, and a refusal changes nothing."""
    fuzz(Target("services", make, run), 1000)
