"""Outcomes of requests: exceptions become the ``Status`` of a response."""

from msg_adapters.errors import MessageError, StaleError, TooLargeError, UnavailableError
from scene_graph_msgs.msg import Status
from scene_graph_ros.geometry.errors import (
    FilterHistoryError,
    InvalidPoseError,
    InvalidShapeError,
    MeshError,
    NameConflictError,
    OwnershipError,
    PropertyError,
    RoleError,
    UnknownIdError,
    UnsupportedPairError,
)
from scene_graph_ros.geometry.model.names import InvalidNameError

__all__ = ["ok_status", "status_from_exception"]

_CODES: dict[type[Exception], int] = {
    UnsupportedPairError: Status.UNSUPPORTED_PAIR,
    UnknownIdError: Status.UNKNOWN_NAME,
    StaleError: Status.STALE,
    FilterHistoryError: Status.INVALID_ARGUMENT,
    InvalidNameError: Status.INVALID_ARGUMENT,
    InvalidPoseError: Status.INVALID_ARGUMENT,
    InvalidShapeError: Status.INVALID_ARGUMENT,
    MeshError: Status.INVALID_ARGUMENT,
    MessageError: Status.INVALID_ARGUMENT,
    PropertyError: Status.INVALID_ARGUMENT,
    RoleError: Status.INVALID_ARGUMENT,
    OwnershipError: Status.NOT_OWNER,
    TooLargeError: Status.TOO_LARGE,
    NameConflictError: Status.NAME_CONFLICT,
    UnavailableError: Status.UNAVAILABLE,
    # Plain argument errors of the core: non-finite points, negative distances. A TypeError is
    # ours, since messages have types.
    ValueError: Status.INVALID_ARGUMENT,
}


_LONGEST = 10_000
"""Characters. Messages quote what was asked for, which may be megabytes."""


def _readable(text: str) -> str:
    if len(text) <= _LONGEST:
        return text
    return f"{text[:_LONGEST]}... and {len(text) - _LONGEST} characters more"


def ok_status() -> Status:
    """Return the status of a request that was answered."""
    return Status(code=Status.OK)


def status_from_exception(error: BaseException) -> Status:
    """Return the status for the caller of ``error``.

    The most derived class in the table decides. An error in no table is a fault of the node:
    INTERNAL_ERROR, without the details, which belong into the log.
    """
    for base in type(error).__mro__:
        if base in _CODES:
            return Status(code=_CODES[base], message=_readable(str(error)))
    return Status(
        code=Status.INTERNAL_ERROR,
        message=f"the node failed with {type(error).__name__}; its log has the details",
    )
