"""Which processors are asked, and which are named as left out."""

from scene_graph_ros.geometry.compiled.kernel_packs import BASELINES
from tools.same_everywhere import Variant, variants_of_bits, variants_of_tolerances


def _names(*asked):
    variants = list(variants_of_bits(*asked))
    run = [each.name for each in variants if isinstance(each, Variant)]
    return run, [each for each in variants if isinstance(each, str)]


def test_every_baseline_and_emulated_processor_is_run_or_named():
    """A processor without AVX-512 leaves out v4; without an emulator three processors are."""
    v4, v3, v2 = BASELINES
    run, left_out = _names([v3, v2], None)
    assert run == ["this processor", v2, v3]
    assert [each.partition(" is left out")[0] for each in left_out] == [
        v4,
        "emulated Nehalem",
        "emulated Haswell",
        "emulated EPYC-Rome",
    ]
    run, left_out = _names([v4, v3, v2], "/usr/bin/qemu-x86_64")
    assert run[:4] == ["this processor", v2, v3, v4]
    assert len(run) == 7
    assert not left_out


def test_tolerances_are_asked_with_both_kernels_of_blas_and_with_numpys_oldest():
    """With one thread and two each; kernels stay this machine's there."""
    variants = list(variants_of_tolerances(["x86-64-v2"]))
    assert len(variants) == 7
    blas = [each.variables for each in variants if "OPENBLAS_CORETYPE" in each.variables]
    assert {(each["OPENBLAS_CORETYPE"], each["OPENBLAS_NUM_THREADS"]) for each in blas} == {
        ("Nehalem", "1"),
        ("Nehalem", "2"),
        ("Haswell", "1"),
        ("Haswell", "2"),
    }
    assert "NPY_DISABLE_CPU_FEATURES" in variants[-1].variables
