"""Ask the same questions as on other processors: `make same-everywhere`.

The corpus of bits has one digest for x86-64-v2, -v3, -v4 and this machine's own processor, with
each of BLAS's kernels, NumPy's and the C library's, and as emulated processors run it (where
`qemu-user` is installed). The corpus of tolerances, which goes through BLAS and NumPy's functions,
keeps to its stated errors with each of them. Kernels of a baseline that are not compiled yet are
compiled first, which takes minutes for each, once. What this processor can't run is named.
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

__all__ = ["Outcome", "Variant", "flaw_of", "main", "table_of", "variants"]

_ROOT = Path(__file__).resolve().parents[1]
_BITS = _ROOT / "test" / "numerics" / "same_bits.py"
_ANSWERS = _ROOT / "test" / "numerics" / "known_answers.py"
_CACHES = _ROOT / "build" / "wheels" / "cp{}{}".format(*sys.version_info) / "kernels"
"""Where `make wheels` has the kernels of each baseline, too: they are compiled once for both."""

_EMULATED = {"Nehalem": "x86-64-v2", "Haswell": "x86-64-v3", "EPYC-Rome": "x86-64-v3"}
"""Processors that are emulated, with the baseline whose kernels they run."""
_BLAS = ("Nehalem", "Haswell")
"""Kernels of OpenBLAS that every processor of today runs."""
_OLD_C_LIBRARY = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"


class Variant(NamedTuple):
    """A way to run the corpora."""

    name: str
    variables: Mapping[str, str]
    prefix: tuple[str, ...] = ()
    has_tolerances: bool = True
    left_out: str = ""
    """Why it is not run, "" where it is."""


class Outcome(NamedTuple):
    """What a variant gave."""

    name: str
    bits: str
    tolerances: str


def _kernels_for(baseline: str) -> dict[str, str]:
    return {
        "NUMBA_CPU_NAME": baseline,
        "NUMBA_CPU_FEATURES": "",
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(_CACHES / baseline),
    }


def variants(here: list[str], emulator: str | None) -> Iterator[Variant]:
    """Yield the ways to run the corpora; ``here`` are the baselines that this processor runs."""
    yield Variant("this processor", {})
    for baseline in reversed(BASELINES):
        why = "" if baseline in here else "this processor does not run it"
        yield Variant(baseline, _kernels_for(baseline), left_out=why)
    for core in _BLAS:
        for threads in ("1", "2"):
            variables = {"OPENBLAS_CORETYPE": core, "OPENBLAS_NUM_THREADS": threads}
            yield Variant(f"BLAS's kernels of {core}, threads: {threads}", variables)
    yield Variant("NumPy's oldest kernels", {"NPY_DISABLE_CPU_FEATURES": _features_of_numpy()})
    yield Variant("the C library's older kernels", {"GLIBC_TUNABLES": _OLD_C_LIBRARY})
    for processor, baseline in _EMULATED.items():
        why = "" if baseline in here else "nobody here compiles its kernels"
        if emulator is None:
            why = "apt-get install qemu-user"
        elif not why and "bmi" in BASELINES[baseline]:
            why = flaw_of(emulator, processor)
        yield Variant(
            f"emulated {processor}, {baseline}",
            _kernels_for(baseline),
            (emulator or "", "-cpu", processor),
            has_tolerances=False,  # its solvers would take hours
            left_out=why,
        )


_PROBE = """
import ctypes, mmap
code = bytes.fromhex("c4e2f8f3df" "0f92c0" "0fb6c0" "c3")  # blsi rax, rdi; setb al; return it
page = mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
page.write(code)
address = ctypes.addressof(ctypes.c_char.from_buffer(page))
carry = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_uint64)(address)
print(carry(0), carry(40))
"""
"""Whether there is a lowest bit, as the instruction BLSI tells by the carry flag."""


def flaw_of(emulator: str, processor: str) -> str:
    """Say which instruction an emulated processor gets wrong, "" where none is known.

    Compilers take the carry flag of BLSI where code asks for the lowest bit of a word and whether
    there is one. Emulators of x86-64-v3 before qemu 8.0 have it the wrong way round.
    """
    command = [emulator, "-cpu", processor, sys.executable, "-c", _PROBE]
    environment = {**os.environ, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
        return f"the emulator does not run Python: {said[-1]}"
    is_right = done.stdout.split() == ["0", "1"]
    return "" if is_right else "the emulator's BLSI has a wrong carry flag; qemu 8.0 has it right"


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


class _Corpora:
    """Runs both corpora, and knows the digests that came first."""

    def __init__(self, parts: list[str] | None) -> None:
        self._parts = parts
        self.digests: list[str] | None = None

    def outcome(self, variant: Variant) -> Outcome:
        if variant.left_out:
            return Outcome(variant.name, f"left out: {variant.left_out}", "")
        return Outcome(variant.name, self._bits(variant), self._tolerances(variant))

    def _bits(self, variant: Variant) -> str:
        exit_code, said = _run(variant, _BITS, *(self._parts or ()))
        lines = said.splitlines()
        if self.digests is None:
            self.digests = lines
        if exit_code != 0:
            return f"ended with {exit_code}"
        others = [line.split()[0] for line in lines if line not in self.digests]
        return f"OTHERS: {', '.join(others)}" if others else "the same"

    def _tolerances(self, variant: Variant) -> str:
        if self._parts is not None or not variant.has_tolerances:
            return ""
        exit_code, said = _run(variant, _ANSWERS, "--off", "0", "1e-12")
        print(said, file=sys.stderr, flush=True)
        return "kept" if exit_code == 0 else "EXCEEDED"


def table_of(outcomes: list[Outcome]) -> str:
    """Return a table of what the variants gave, in Markdown."""
    lines = ["| with | bits | tolerances |", "| --- | --- | --- |"]
    lines += [f"| {' | '.join(each)} |".replace("|  |", "| |") for each in outcomes]
    return "\n".join(lines)


def main() -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.same_everywhere", description=__doc__)
    parser.add_argument("--bits", nargs="*", help="only these parts of the corpus of bits")
    parser.add_argument("--only", nargs="+", help="only variants whose name has one of these")
    given = parser.parse_args()
    corpora, outcomes = _Corpora(given.bits), list[Outcome]()
    emulator = shutil.which("qemu-x86_64") or shutil.which("qemu-x86_64-static")
    for variant in variants(baselines_here(), emulator):
        is_asked = given.only is None or any(part in variant.name for part in given.only)
        if outcomes and not is_asked:  # the first is what all others are compared with
            continue
        outcomes.append(corpora.outcome(variant))
        print(": ".join(filter(None, outcomes[-1])), flush=True)
    print("", *corpora.digests or (), "", table_of(outcomes), sep="\n")
    is_good = {"", "the same", "kept"}
    failed = [
        each.name
        for each in outcomes
        if not each.bits.startswith("left out") and not {*each[1:]} <= is_good
    ]
    print("\nNot the same:", "; ".join(failed) or "none")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
