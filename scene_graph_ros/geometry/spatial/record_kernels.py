"""Poses among the bytes of records, with the times that they are of."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.record_bytes import number_at, seconds_at, word_at
from scene_graph_ros.geometry.spatial.pose_kernels import VALID
from scene_graph_ros.geometry.spatial.quaternion_kernels import judge, write_pose

__all__ = [
    "EARLY",
    "IN_TIME",
    "LATE",
    "OUT_OF_ORDER",
    "are_valid",
    "judge_time",
    "judge_times",
    "latest",
    "place_records",
]

IN_TIME = 0
EARLY = 1
LATE = 2
OUT_OF_ORDER = 3

_NANOSECONDS = 10**9
_EARLIEST = -(2**63)
_WORD_SIZE = 4
_NUMBER_SIZE = 8


@lean_kernel
def judge_time(time, newest, earliest, latest):
    """Return the fault of a time, such as EARLY; it is not to be before ``newest``."""
    if time < earliest:
        return EARLY
    if time > latest:
        return LATE
    return OUT_OF_ORDER if time < newest else IN_TIME


@lean_kernel
def judge_times(times, rows, newest, limits, statuses):
    """Judge the time of each record, of which ``newest[rows[i]]`` is the time before.

    Times of 0 become the first of ``limits``, which are those of `place_records`; a record of
    no row, below 0, has IN_TIME. ``times``, ``rows`` and ``statuses`` are ``(n,)``. Returns how
    many are not in time.
    """
    now, earliest, latest = limits
    count = 0
    for i in range(times.shape[0]):
        if times[i] == 0:
            times[i] = now
        statuses[i] = IN_TIME
        if rows[i] >= 0:
            statuses[i] = judge_time(times[i], newest[rows[i] & LAST_PLACE], earliest, latest)
            count += statuses[i] != IN_TIME
    return count


@lean_kernel
def _components(data, place):
    """Return the seven numbers of a record: position and quaternion."""
    return (
        number_at(data, place),
        number_at(data, place + _NUMBER_SIZE),
        number_at(data, place + 2 * _NUMBER_SIZE),
        number_at(data, place + 3 * _NUMBER_SIZE),
        number_at(data, place + 4 * _NUMBER_SIZE),
        number_at(data, place + 5 * _NUMBER_SIZE),
        number_at(data, place + 6 * _NUMBER_SIZE),
    )


@lean_kernel
def _time_at(data, place, now):
    """Return a time in nanoseconds; one of 0 stands for ``now``."""
    time = seconds_at(data, place) * _NANOSECONDS + word_at(data, place + _WORD_SIZE)
    return now if time == 0 else time


@lean_kernel
def are_valid(data, numbers):
    """Tell whether there is nothing against the position and quaternion of any record.

    ``data`` are ``bytes``; the seven numbers of record i begin at ``numbers[i]``.
    """
    for i in range(numbers.shape[0]):
        p0, p1, p2, x, y, z, w = _components(data, numbers[i])
        if judge(p0, p1, p2, x, y, z, w) != VALID:
            return False
    return True


@lean_kernel
def place_records(data, numbers, times, limits, rows, X, newest):
    """Write the poses of records among bytes to rows of X, and their times to ``newest``.

    ``data`` are ``bytes``. Record i has position and quaternion, seven numbers, at ``numbers[i]``,
    and belongs to row ``rows[i]``. At ``times`` are seconds and nanoseconds, 4 bytes each: of each
    record, or one for all. ``limits`` are the substitute of a time of 0, the earliest and the
    latest time that is right, in nanoseconds; no record may be earlier than the newest of its row.
    All places must be right. Returns whether there is nothing against any record; else nothing was
    written.
    """
    if not are_valid(data, numbers):
        return False
    now, earliest, latest = limits
    last = times.shape[0] - 1
    for i in range(numbers.shape[0]):
        time = _time_at(data, times[min(i, last)], now)
        if judge_time(time, newest[rows[i] & LAST_PLACE], earliest, latest) != IN_TIME:
            return False
    for i in range(numbers.shape[0]):
        k = rows[i] & LAST_PLACE
        p0, p1, p2, x, y, z, w = _components(data, numbers[i])
        write_pose(p0, p1, p2, x, y, z, w, X, k)
        newest[k] = _time_at(data, times[min(i, last)], now)
    return True


@lean_kernel
def latest(times):
    """Return the largest of times ``(n,)``, the smallest that there can be where n is 0."""
    result = _EARLIEST
    for i in range(times.shape[0]):
        result = max(result, times[i])
    return result
