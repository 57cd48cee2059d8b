"""Nothing in the core goes through functions whose last bits depend on the processor."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

_ROOT = Path(__file__).parents[3] / "scene_graph_ros"
_FOLDERS = ("geometry", "robots", "planning/edges", "planning/pairs", "planning/checker")
_OF_LIBRARIES = {
    *("exp", "expm1", "exp2", "log", "log2", "log10", "log1p", "power", "pow", "float_power"),
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "sinc"),
    *("arcsin", "arccos", "arctan", "arctan2", "cbrt"),
    *("dot", "matmul", "inner", "vdot", "tensordot"),
}
"""Functions of numpy and math that `spatial/elementary.py` and `spatial/sums.py` stand in for.

Roots, `hypot`, `ldexp` and `frexp` are rounded alike everywhere; `einsum` sums in one order.
"""
_FOREIGN = {
    "geometry/perception/traced": "what Mitsuba is given, and its images",
    "geometry/perception/gltf": "what another program is given",
    "geometry/perception/surfaces.py": "what foreign renderers and viewers are given",
    "geometry/perception/srgb.py": "what foreign renderers and viewers are given",
    "geometry/query/distance/fcl_engine.py": "another engine",
    "geometry/reals.py": "whether all of many numbers are finite",
    "geometry/meshes/volume_mesh.py": "determinants of permutations, which are rounded to 1 or -1",
}


def _name(node: ast.expr) -> str:
    return ast.unparse(node) if isinstance(node, ast.Attribute) else ""


def _asks_a_library(node: ast.AST) -> bool:
    """Tell whether an expression's value may have other last bits on another processor."""
    if isinstance(node, ast.BinOp):
        if isinstance(node.op, ast.MatMult):
            return True
        # Whole powers of numbers are products up to squares; of 2 they are exact.
        is_exact = isinstance(node.left, ast.Constant) and node.left.value in (0.5, 2, 10)
        is_square = isinstance(node.right, ast.Constant) and node.right.value == 2
        return isinstance(node.op, ast.Pow) and not is_exact and not is_square
    if not isinstance(node, ast.Call):
        return False
    module, _, function = _name(node.func).rpartition(".")
    if module == "np" and function in ("argsort", "argpartition"):
        # Equals come in another order where a processor sorts several at a time.
        return all(ast.unparse(each) != "kind='stable'" for each in node.keywords)
    if module == "np.linalg":
        # Along an axis numpy sums by itself.
        return function != "norm" or all(each.arg != "axis" for each in node.keywords)
    return module in ("np", "math", "cmath") and function in _OF_LIBRARIES


def _places(source: str) -> list[str]:
    tree = ast.parse(source)
    return [
        f"{node.lineno}: {ast.unparse(node)}" for node in ast.walk(tree) if _asks_a_library(node)
    ]


@pytest.mark.parametrize("folder", _FOLDERS)
def test_no_answer_goes_through_a_librarys_last_bits(folder):
    """But for foreign engines, and what is rounded."""
    found = {
        name: places
        for path in sorted((_ROOT / folder).rglob("*.py"))
        if not any(
            (name := str(path.relative_to(_ROOT))).startswith(foreign) for foreign in _FOREIGN
        )
        and (places := _places(path.read_text()))
    }
    assert not found


@pytest.mark.parametrize(
    "source",
    [
        "A @ b",
        "np.linalg.solve(A, b)",
        "np.linalg.norm(v)",
        "np.argsort(x)",
        "math.atan2(y, x)",
        "x**0.5",
        "x**3",
    ],
)
def test_such_expressions_are_found(source):
    """Each of their kinds."""
    assert _places(source)


@pytest.mark.parametrize(
    "source",
    ["np.linalg.norm(A, axis=1)", "math.sqrt(x)", "np.einsum('ij,j->i', A, b)", "x**2", "2.0**x"],
)
def test_what_is_rounded_alike_is_not(source):
    """Roots, products, sums in one order and powers of two."""
    assert not _places(source)
