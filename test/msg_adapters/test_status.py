"""Exceptions become statuses."""

import pytest

from msg_adapters import errors as adapter_errors
from msg_adapters.status import ok_status, status_from_exception
from scene_graph_msgs.msg import Status
from scene_graph_ros.geometry import errors


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.UnsupportedPairError("a"), Status.UNSUPPORTED_PAIR),
        (errors.UnknownIdError("b"), Status.UNKNOWN_NAME),
        (adapter_errors.StaleError("c"), Status.STALE),
        (errors.InvalidPoseError("d"), Status.INVALID_ARGUMENT),
        (errors.InvalidShapeError("e"), Status.INVALID_ARGUMENT),
        (errors.MeshError("f"), Status.INVALID_ARGUMENT),
        (errors.PropertyError("g"), Status.INVALID_ARGUMENT),
        (errors.RoleError("h"), Status.INVALID_ARGUMENT),
        (adapter_errors.MessageError("i"), Status.INVALID_ARGUMENT),
        (errors.FilterHistoryError("j"), Status.INVALID_ARGUMENT),
        (ValueError("j"), Status.INVALID_ARGUMENT),
        (errors.OwnershipError("k"), Status.NOT_OWNER),
        (adapter_errors.TooLargeError("l"), Status.TOO_LARGE),
        (errors.NameConflictError("m"), Status.NAME_CONFLICT),
        (adapter_errors.UnavailableError("n"), Status.UNAVAILABLE),
    ],
)
def test_each_error_has_its_code_and_keeps_its_words(error: Exception, code: int) -> None:
    """The caller reads the same sentence as whoever called the core."""
    status = status_from_exception(error)
    assert (status.code, status.message) == (code, str(error))


def test_a_key_error_is_told_without_quotes() -> None:
    """Python prints a KeyError's text in quotes; the status has it as written."""
    assert status_from_exception(errors.UnknownIdError("no frame 'x'")).message == "no frame 'x'"


def test_a_derived_error_has_the_code_of_its_nearest_base() -> None:
    """An error that a part of the core derives from a known one is answered like it."""

    class DerivedError(errors.OwnershipError):
        pass

    assert status_from_exception(DerivedError("x")).code == Status.NOT_OWNER


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("secret"), TypeError("secret"), KeyError("secret")]
)
def test_a_fault_of_the_node_is_no_fault_of_the_caller(error: Exception) -> None:
    """Unknown errors are internal; their text stays in the log."""
    status = status_from_exception(error)
    assert status.code == Status.INTERNAL_ERROR
    assert type(error).__name__ in status.message and "secret" not in status.message


def test_success_says_nothing() -> None:
    """OK is zero, so that it is not set by chance to anything else."""
    assert ok_status() == Status(code=0, message="")


def test_every_code_is_different() -> None:
    """No two constants of the message share a number."""
    values = [getattr(Status, name) for name in dir(Status) if name.isupper()]
    constants = [value for value in values if isinstance(value, int)]
    assert sorted(constants) == list(range(10))


def test_long_messages_are_cut():
    """A message that quotes a megabyte says how it begins, and how long it was."""
    status = status_from_exception(adapter_errors.MessageError("x" * 1_000_000))
    assert status.message == "x" * 10_000 + "... and 990000 characters more"
    assert status_from_exception(adapter_errors.MessageError("x" * 10_000)).message == "x" * 10_000
