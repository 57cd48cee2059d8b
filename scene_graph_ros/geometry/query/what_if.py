"""The same question about many configurations of a scene, by several threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.query.arguments import checked_threads
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["ask_what_if"]

Result = TypeVar("Result")


def ask_what_if(
    query: QueryObject,
    configurations: Sequence[Mapping[FrameId, ArrayLike]],
    question: Callable[[QueryObject], Result],
    *,
    threads: int = 1,
) -> list[Result]:
    """Return the answers of ``question`` for each configuration, in their order.

    A configuration gives poses ``X_PF`` ``(4, 4)`` of some frames; the others are where ``query``
    has them, and nothing is moved. ``question`` gets a query object of the configuration:

        ask_what_if(query, [{arm: X} for X in path], QueryObject.has_collisions, threads=2)

    ``threads`` share the configurations, each a row of neighbours, so that a path costs as little
    as its motion; the answers are the same for any number of them. The interpreter's lock is free
    while the kernels run: threads pay where those take most of the time.

    Raises UnknownIdError and InvalidPoseError as ``Context.set_frame_poses`` does,
    QueryArgumentError for ``threads`` that is no integer >= 1, and unless the others are a query
    object, a sequence of mappings and a function, and the errors of ``question``.
    """
    _check(query, configurations, question)
    base = query.snapshot
    count = len(configurations)
    parts = max(min(checked_threads(threads), count), 1)

    def answer(share: range) -> list[Result]:
        # What the context remembers of the poses that are is not disturbed by those that aren't.
        own = base.with_frame_poses({}, memory=Memory())
        return [
            question(QueryObject(own.with_frame_poses(configurations[index]))) for index in share
        ]

    shares = [range(k * count // parts, (k + 1) * count // parts) for k in range(parts)]
    if parts == 1:
        return answer(shares[0])
    with ThreadPoolExecutor(parts) as pool:
        return [result for answers in pool.map(answer, shares) for result in answers]


def _check(query: Any, configurations: Any, question: Any) -> None:
    if not isinstance(query, QueryObject):
        raise QueryArgumentError(f"query must be a QueryObject, not {quoted(query)}")
    if not callable(question):
        raise QueryArgumentError(f"question must be a function, not {quoted(question)}")
    if not isinstance(configurations, Sequence) or isinstance(configurations, (str, bytes)):
        raise QueryArgumentError(
            f"configurations must be a sequence of mappings, not {quoted(configurations)}"
        )
    for index, configuration in enumerate(configurations):
        if not isinstance(configuration, Mapping):
            raise QueryArgumentError(
                f"configurations[{index}] must map frame ids to poses, not {quoted(configuration)}"
            )
