"""Times and durations in both directions."""

from builtin_interfaces.msg import Duration, Time
from hypothesis import given
from hypothesis import strategies as st
import pytest

from msg_adapters.stamps import (
    duration_from_msg,
    duration_to_msg,
    EARLIEST,
    LATEST,
    stamp_from_msg,
    stamp_problem,
    stamp_to_msg,
)


def test_a_stamp_is_nanoseconds_since_the_epoch() -> None:
    """Seconds count 1e9 and nanoseconds one."""
    assert stamp_from_msg(Time(sec=12, nanosec=345)) == 12_000_000_345
    assert stamp_to_msg(12_000_000_345) == Time(sec=12, nanosec=345)


def test_a_negative_duration_keeps_its_nanoseconds_positive() -> None:
    """-1.25 s is -2 s plus 0.75 s, as the message defines it."""
    assert duration_to_msg(-1_250_000_000) == Duration(sec=-2, nanosec=750_000_000)
    assert duration_from_msg(Duration(sec=-2, nanosec=750_000_000)) == -1_250_000_000


@given(st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1))
def test_every_stamp_that_fits_survives_a_round_trip(stamp_ns: int) -> None:
    """No nanosecond is lost anywhere in the 32 bits of seconds."""
    assert stamp_from_msg(stamp_to_msg(stamp_ns)) == stamp_ns
    assert duration_from_msg(duration_to_msg(stamp_ns)) == stamp_ns


@pytest.mark.parametrize("stamp_ns", [2**31 * 10**9, -(2**31) * 10**9 - 1])
def test_a_stamp_that_does_not_fit_is_refused(stamp_ns: int) -> None:
    """One nanosecond beyond the field's range raises instead of wrapping around."""
    with pytest.raises(OverflowError, match=str(stamp_ns)):
        stamp_to_msg(stamp_ns)


def test_nanoseconds_that_a_second_does_not_have_are_a_problem() -> None:
    """The field could hold four seconds; a stamp with one or more of them is named."""
    assert stamp_problem(Time(sec=5, nanosec=999_999_999)) == ""
    assert "1000000000" in stamp_problem(Time(sec=5, nanosec=10**9))


def test_the_stamps_that_a_message_can_say_are_those_that_can_be_written() -> None:
    """Both ends can be written, what is beyond can't."""
    for end, outside in ((EARLIEST, EARLIEST - 1), (LATEST, LATEST + 1)):
        assert stamp_from_msg(stamp_to_msg(end)) == end
        with pytest.raises(OverflowError):
            stamp_to_msg(outside)
