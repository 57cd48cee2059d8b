"""Times and durations: nanoseconds as a Python int on our side, two fields on the wire."""

from builtin_interfaces.msg import Duration, Time

from msg_adapters.errors import MessageError

__all__ = [
    "EARLIEST",
    "LATEST",
    "checked_stamp_from_msg",
    "duration_from_msg",
    "duration_to_msg",
    "stamp_from_msg",
    "stamp_problem",
    "stamp_to_msg",
]

_NANOSECONDS = 1_000_000_000
_MAX_SECONDS = 2**31 - 1

EARLIEST = (-_MAX_SECONDS - 1) * _NANOSECONDS
LATEST = _MAX_SECONDS * _NANOSECONDS + _NANOSECONDS - 1
"""The stamps that a message can say, in nanoseconds."""


def stamp_problem(stamp: Time) -> str:
    """Say why a message is no time, or "": the whole seconds of ``nanosec`` belong to ``sec``."""
    if stamp.nanosec < _NANOSECONDS:
        return ""
    return f"nanosec is {stamp.nanosec}, a second has only {_NANOSECONDS}"


def stamp_from_msg(stamp: Time) -> int:
    """Return nanoseconds since the clock's epoch."""
    return stamp.sec * _NANOSECONDS + stamp.nanosec


def checked_stamp_from_msg(stamp: Time) -> int:
    """Return nanoseconds since the clock's epoch; raises MessageError for an invalid stamp."""
    problem = stamp_problem(stamp)
    if problem:
        raise MessageError(f"the stamp is no time: {problem}")
    return stamp_from_msg(stamp)


def stamp_to_msg(stamp_ns: int) -> Time:
    """Return the message for nanoseconds since the epoch.

    Raises OverflowError for a stamp that the 32 bits of the message can't hold.
    """
    seconds, nanoseconds = _split(stamp_ns)
    return Time(sec=seconds, nanosec=nanoseconds)


def duration_from_msg(duration: Duration) -> int:
    """Return nanoseconds; negative durations stay negative."""
    return duration.sec * _NANOSECONDS + duration.nanosec


def duration_to_msg(duration_ns: int) -> Duration:
    """Return the message for a duration in nanoseconds.

    Raises OverflowError for one that the 32 bits of the message can't hold.
    """
    seconds, nanoseconds = _split(duration_ns)
    return Duration(sec=seconds, nanosec=nanoseconds)


def _split(nanoseconds: int) -> tuple[int, int]:
    # Floor division keeps the nanoseconds positive, as the messages define them.
    seconds, rest = divmod(int(nanoseconds), _NANOSECONDS)
    if not -_MAX_SECONDS - 1 <= seconds <= _MAX_SECONDS:
        raise OverflowError(f"{nanoseconds} ns does not fit into 32 bits of seconds")
    return seconds, rest
