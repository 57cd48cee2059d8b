"""Which processors are asked, which are named as left out, and the table of what they gave."""

import pytest

from scene_graph_ros.geometry.compiled.kernel_packs import BASELINES, baselines_here
from tools import same_everywhere
from tools.same_everywhere import flaw_of, Outcome, table_of, variants


def _names(*asked):
    asked_for = list(variants(*asked))
    run = [each.name for each in asked_for if not each.left_out]
    return run, {each.name: each.left_out for each in asked_for if each.left_out}


def test_every_baseline_and_emulated_processor_is_run_or_named(monkeypatch):
    """A processor without AVX-512 leaves out v4; without an emulator three processors are."""
    monkeypatch.setattr(same_everywhere, "flaw_of", lambda emulator, processor: "")
    v4, v3, v2 = BASELINES
    run, left_out = _names([v3, v2], None)
    assert run[:3] == ["this processor", v2, v3]
    emulated = [f"emulated {each}" for each in (f"Nehalem, {v2}", f"Haswell, {v3}")]
    assert list(left_out) == [v4, *emulated, f"emulated EPYC-Rome, {v3}"]
    assert "qemu-user" in left_out[emulated[0]]
    run, left_out = _names([v4, v3, v2], "/usr/bin/qemu-x86_64")
    assert run[:4] == ["this processor", v2, v3, v4]
    assert len(run) == 13
    assert not left_out
    monkeypatch.setattr(same_everywhere, "flaw_of", lambda emulator, processor: "wrong")
    assert list(_names([v4, v3, v2], "/usr/bin/qemu-x86_64")[1].values()) == ["wrong"] * 2


def test_both_kernels_of_blas_numpys_and_the_c_librarys_oldest_are_asked():
    """BLAS with one thread and two each; kernels stay this machine's there."""
    asked_for = list(variants(["x86-64-v2"], None))
    blas = [each.variables for each in asked_for if "OPENBLAS_CORETYPE" in each.variables]
    assert {(each["OPENBLAS_CORETYPE"], each["OPENBLAS_NUM_THREADS"]) for each in blas} == {
        ("Nehalem", "1"),
        ("Nehalem", "2"),
        ("Haswell", "1"),
        ("Haswell", "2"),
    }
    named = [name for each in asked_for for name in each.variables]
    assert named.count("NPY_DISABLE_CPU_FEATURES") == named.count("GLIBC_TUNABLES") == 1


@pytest.mark.parametrize(
    ("script", "flaw"),
    [
        ("echo 0 1", ""),
        ("echo 1 0", "BLSI"),
        ("echo", "BLSI"),
        ("exit 3", "does not run Python: ended with 3"),
        ("echo a; echo 'no library' >&2; exit 127", "does not run Python: no library"),
    ],
)
def test_an_emulator_that_counts_bits_wrongly_is_named(tmp_path, script, flaw):
    """It is asked by machine code; one that can't run that says why."""
    emulator = tmp_path / "emulator"
    emulator.write_text(f"#!/bin/sh\n{script}\n")
    emulator.chmod(0o755)
    found = flaw_of(str(emulator), "Haswell")
    assert flaw in found
    assert bool(flaw) == bool(found)


@pytest.mark.skipif("x86-64-v3" not in baselines_here(), reason="the code is for x86-64-v3")
def test_a_processor_tells_the_lowest_bit_as_its_maker_says(tmp_path):
    """What runs the probe as it is, without emulating anything, has no flaw."""
    runner = tmp_path / "runner"
    runner.write_text('#!/bin/sh\nshift 2\nexec "$@"\n')
    runner.chmod(0o755)
    assert flaw_of(str(runner), "Haswell") == ""


def test_the_table_has_a_row_for_each_variant():
    """Also for one that is left out."""
    outcomes = [
        Outcome("this processor", "the same", "kept"),
        Outcome("x86-64-v4", "left out: this processor does not run it", ""),
    ]
    assert table_of(outcomes).splitlines() == [
        "| with | bits | tolerances |",
        "| --- | --- | --- |",
        "| this processor | the same | kept |",
        "| x86-64-v4 | left out: this processor does not run it | |",
    ]
