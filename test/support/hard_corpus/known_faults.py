"""Faults that are known, measured and not fixed yet: excused by name, and reported when gone."""

from collections.abc import Iterable, Sequence
import re
from typing import Any, NamedTuple

import pytest

from hard_corpus.batches import Complaint

__all__ = ["KnownFault", "judged", "outcomes"]


class KnownFault(NamedTuple):
    """Which cases, at which parameters, are off in which quantities, by how much at most."""

    values: tuple[Any, ...]
    labels: str
    quantities: str
    worst: float
    why: str

    def covers(self, value: Any, complaint: Complaint) -> bool:
        """Tell whether the complaint is this fault, and no worse than measured."""
        return (
            value in self.values
            and re.fullmatch(self.labels, complaint.label) is not None
            and re.fullmatch(self.quantities, complaint.quantity) is not None
            and complaint.excess <= self.worst
        )


def outcomes(values: Iterable[Any], known: Sequence[KnownFault]):
    """Return parameters (value, fault): every value with None, and every fault as a strict xfail.

    A test that takes them asserts that ``judged`` finds nothing. With None that means nothing
    but known faults; with a fault, that it is gone: then its row has to go as well.
    """
    plain = [pytest.param(value, None, id=f"{value}") for value in values]
    return plain + [
        pytest.param(
            value,
            fault,
            id=f"{value} {fault.why}",
            marks=pytest.mark.xfail(strict=True, reason=f"up to {fault.worst} L: {fault.why}"),
        )
        for fault in known
        for value in fault.values
    ]


def judged(
    found: Iterable[Complaint],
    value: Any,
    fault: KnownFault | None,
    known: Sequence[KnownFault],
) -> list[Complaint]:
    """Return the complaints that are no known fault, or those that are this ``fault``."""
    if fault is not None:
        return [complaint for complaint in found if fault.covers(value, complaint)]
    return [c for c in found if not any(row.covers(value, c) for row in known)]
