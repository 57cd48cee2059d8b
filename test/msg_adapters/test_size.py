"""The memory of a message: what can be large is counted."""

from __future__ import annotations

import numpy as np
import pytest

from msg_adapters.size import size_of
from scene_graph_msgs.msg import GeometryDescription, QueryOptions, Shape, WhatIf
from scene_graph_msgs.srv import (
    ComputeSignedDistanceToPoint,
    GetPoseInWorld,
    RegisterGeometry,
)

THOUSAND_POSES = QueryOptions(what_if=WhatIf(frames=["a"], poses=[0.0] * 7000))


@pytest.mark.parametrize(
    ("request_", "bytes_"),
    [
        # Three numbers of eight bytes each.
        (ComputeSignedDistanceToPoint.Request(points=np.zeros(30_000)), 240_000),
        (GetPoseInWorld.Request(frames=["x" * 500] * 1000), 500_000),
        (GetPoseInWorld.Request(options=THOUSAND_POSES), 56_000),
        (
            RegisterGeometry.Request(
                geometries=[GeometryDescription(shape=Shape(contents=bytes(90_000)))] * 2
            ),
            180_000,
        ),
    ],
)
def test_what_can_be_large_is_counted(request_, bytes_):
    """Arrays, texts, and both inside of other messages, to a tenth of what they hold."""
    assert bytes_ <= size_of(request_) <= 1.1 * bytes_


def test_a_small_request_is_small():
    """As most are."""
    assert size_of(GetPoseInWorld.Request(frames=["hand"])) < 1000
