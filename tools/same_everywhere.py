"""Ask the same questions as on other processors: `make same-everywhere`.

What kernels alone answer has one digest for x86-64-v2, -v3, -v4 and this machine's own processor,
also as emulated processors run it (`qemu-user`, where that is installed). What goes through BLAS
or NumPy's functions keeps to its stated errors with each of their kernels. Kernels of a baseline
that are not compiled yet are compiled first, which takes minutes for each, once.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import shutil
import subprocess
import sys
from typing import NamedTuple

from scene_graph_ros.geometry.compiled.kernel_packs import BASELINES, baselines_here

__all__ = ["Variant", "main", "variants_of_bits", "variants_of_tolerances"]

_ROOT = Path(__file__).resolve().parents[1]
_BITS = _ROOT / "test" / "numerics" / "same_bits.py"
_ANSWERS = _ROOT / "test" / "numerics" / "known_answers.py"
_CACHES = _ROOT / "build" / "kernels"

_EMULATED = {"Nehalem": "x86-64-v2", "Haswell": "x86-64-v3", "EPYC-Rome": "x86-64-v3"}
"""Processors that are emulated, with the baseline whose kernels they run."""


class Variant(NamedTuple):
    """A way to run a corpus."""

    name: str
    variables: Mapping[str, str]
    prefix: tuple[str, ...] = ()


def _kernels_for(baseline: str) -> dict[str, str]:
    return {
        "NUMBA_CPU_NAME": baseline,
        "NUMBA_CPU_FEATURES": "",
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(_CACHES / baseline),
    }


def variants_of_bits(here: list[str], emulator: str | None) -> Iterator[Variant | str]:
    """Yield the ways to run the corpus of bits, and a sentence for each that is left out."""
    yield Variant("this processor", {})
    for baseline in reversed(BASELINES):
        if baseline in here:
            yield Variant(baseline, _kernels_for(baseline))
        else:
            yield f"{baseline} is left out: this processor does not run it"
    for processor, baseline in _EMULATED.items():
        if emulator is None:
            yield f"emulated {processor} is left out: apt-get install qemu-user"
        elif baseline in here:  # else there is nobody to compile its kernels
            prefix = (emulator, "-cpu", processor)
            yield Variant(f"emulated {processor}", _kernels_for(baseline), prefix)


def variants_of_tolerances(here: list[str]) -> Iterator[Variant]:
    """Yield the ways to run the corpus of tolerances."""
    yield Variant("this processor", {})
    for baseline in here:
        yield Variant(baseline, _kernels_for(baseline))
    for core in ("Nehalem", "Haswell"):
        for threads in ("1", "2"):
            variables = {"OPENBLAS_CORETYPE": core, "OPENBLAS_NUM_THREADS": threads}
            yield Variant(f"BLAS {core}, {threads} threads", variables)
    yield Variant("NumPy's oldest kernels", {"NPY_DISABLE_CPU_FEATURES": _features_of_numpy()})


def _features_of_numpy() -> str:
    """Return those newer features of which NumPy has kernels: it refuses to disable others."""
    ask = (
        "from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__\n"
        "print(*(f for f in __cpu_dispatch__ if __cpu_features__.get(f)))"
    )
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def _run(variant: Variant, script: Path, *arguments: str) -> tuple[int, str]:
    command = [*variant.prefix, sys.executable, str(script), *arguments]
    environment = {**os.environ, **variant.variables, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=False)
    return done.returncode, done.stdout


def _compare_bits(parts: list[str]) -> list[str]:
    """Run the corpus of bits; return the variants whose digests are not the first's."""
    first: list[str] | None = None
    differing = []
    emulator = shutil.which("qemu-x86_64") or shutil.which("qemu-x86_64-static")
    for variant in variants_of_bits(baselines_here(), emulator):
        if isinstance(variant, str):
            print(f"bits: {variant}", flush=True)
            continue
        exit_code, said = _run(variant, _BITS, *parts)
        lines = said.splitlines()
        first = lines if first is None else first
        told = [f"  {line}" for line in lines if line not in first]
        is_same = exit_code == 0 and lines == first
        print(f"bits: {variant.name}: {'the same' if is_same else 'others'}", *told, sep="\n")
        if not is_same:
            differing.append(f"bits, {variant.name}")
    print("\n".join(first or []), flush=True)
    return differing


def _check_tolerances() -> list[str]:
    """Run the corpus of tolerances; return the variants in which an answer is off by more."""
    failed = []
    for variant in variants_of_tolerances(baselines_here()):
        exit_code, said = _run(variant, _ANSWERS)
        print(f"tolerances: {variant.name}: {'kept' if exit_code == 0 else 'exceeded'}")
        if exit_code != 0:
            print(said, flush=True)
            failed.append(f"tolerances, {variant.name}")
    return failed


def main() -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.same_everywhere", description=__doc__)
    parser.add_argument("--bits", nargs="*", help="only these parts of the corpus of bits")
    given = parser.parse_args()
    failed = _compare_bits(given.bits or [])
    if given.bits is None:
        failed += _check_tolerances()
    print("Not the same:", ", ".join(failed) or "none")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
