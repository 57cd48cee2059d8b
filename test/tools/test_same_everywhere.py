"""Which processors are asked, which are named as left out, and the table of what they gave."""

from scene_graph_ros.geometry.compiled.kernel_packs import BASELINES
from tools.same_everywhere import Outcome, table_of, variants


def _names(*asked):
    asked_for = list(variants(*asked))
    run = [each.name for each in asked_for if not each.left_out]
    return run, {each.name: each.left_out for each in asked_for if each.left_out}


def test_every_baseline_and_emulated_processor_is_run_or_named():
    """A processor without AVX-512 leaves out v4; without an emulator three processors are."""
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
