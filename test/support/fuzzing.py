"""Run random cases against a target: seeded, cut down to what still fails, or without end.

A case is a list of steps that are plain data. It is made of a seed, so that a seed says it all;
of a case that fails, steps are left out as long as it fails in the same way.

    make fuzz                                   an hour of new seeds, SECONDS= for another time
    FUZZ_SEED=8123 make fuzz                    one case again
"""

from __future__ import annotations

from collections.abc import Callable
import os
import random
import resource
import signal
import time
from typing import Any, NamedTuple

__all__ = ["BAD_NUMBERS", "BAD_TEXTS", "Target", "fuzz"]

CPU_SECONDS = 60.0
"""Of one case; its own thread's and others', but not what other processes take."""

MEMORY = 1_500_000
"""Kilobytes that the process may grow by during all cases of a target."""

BAD_NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 0.5, 1e-9, 5e-324, 1e-300, 1e9, 1e13, 1e300, 1.7e308,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip

BAD_TEXTS = (
    "", " ", "a", "arm", "world", "~", "/", "//", "a/b", "a b", "two words!", "\n", "\x00",
    "\x1b[0m", "é☃", "{x}", "%s%n", "..", "../..", "/dev/zero", "/proc/kmsg", "/nonexistent", "package://x/y",
    "file:///", "http://x", "'\"`$(:)", "a" * 300, "b" * 100_000,
)  # fmt: skip

Steps = list[Any]


class Target(NamedTuple):
    """What is tried."""

    name: str
    make: Callable[[random.Random], Steps]
    """Return the steps of a case."""
    run: Callable[[Steps], None]
    """Take the steps; raises where something happens that should not."""


def fuzz(target: Target, count: int) -> None:
    """Try ``count`` cases, always the same; or as many as FUZZ_SECONDS allow, always others."""
    given, seconds = os.environ.get("FUZZ_SEED"), float(os.environ.get("FUZZ_SECONDS", "0"))
    before = _peak_memory()
    if given is not None:
        _try(target, int(given))
    elif seconds > 0.0:
        end = time.monotonic() + seconds
        seeds = random.SystemRandom()
        tried = 0
        while time.monotonic() < end:
            _try(target, seeds.getrandbits(48))
            tried += 1
        print(f"{target.name}: {tried} cases in {seconds:.0f} s")
    else:
        for seed in range(count):
            _try(target, seed)
    grown = _peak_memory() - before
    assert grown < MEMORY, f"{target.name}: memory grew by {grown} kB"


def _peak_memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _try(target: Target, seed: int) -> None:
    steps = target.make(random.Random(f"{target.name} {seed}"))
    problem = _problem(target, steps)
    if problem is None:
        return
    fewest = _reduced(target, steps, type(problem))
    problem = _problem(target, fewest) or problem
    lines = "\n".join(f"    {step!r}"[:1000] for step in fewest)
    raise AssertionError(
        f"{target.name}: FUZZ_SEED={seed}: {type(problem).__name__}: {str(problem)[:2000]}\n"
        f"cut down to {len(fewest)} of {len(steps)} steps:\n{lines}"
    ) from problem


class _TooLong(Exception):  # noqa: N818 - what happened, not an error of the program
    """A case took more processor time than one may."""


def _alarm(_signal: int, _frame: Any) -> None:
    raise _TooLong(f"more than {CPU_SECONDS} s of processor time")


def _problem(target: Target, steps: Steps) -> Exception | None:
    """Return what a case raises, or None."""
    signal.signal(signal.SIGPROF, _alarm)
    signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
    try:
        target.run(list(steps))
    except Exception as error:  # noqa: BLE001 - whatever it is, it is what was looked for
        return error
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return None


def _reduced(target: Target, steps: Steps, kind: type[Exception]) -> Steps:
    """Leave out steps, many at a time and then one by one, as long as the failure is the same."""
    size = len(steps) // 2
    while size:
        start = 0
        while start < len(steps):
            fewer = steps[:start] + steps[start + size :]
            if type(_problem(target, fewer)) is kind:
                steps = fewer
            else:
                start += size
        size //= 2
    return steps
