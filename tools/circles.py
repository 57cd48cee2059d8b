"""Find modules that import each other in a circle: `python -m tools.circles`.

All imports count, also those inside functions and those for annotations alone: a module that can
be understood only with another is not apart from it, whenever it imports it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
import sys

__all__ = ["circle", "imports_of"]

_ROOT = Path(__file__).resolve().parents[1]
_PACKAGES = ("scene_graph_ros", "msg_adapters", "benchmarks", "tools")


def imports_of(root: Path, packages: Iterable[str]) -> dict[str, set[str]]:
    """Return what each module of some packages below ``root`` imports of them, by dotted names."""
    files = {
        _name(path.relative_to(root)): path
        for package in packages
        for path in (root / package).rglob("*.py")
    }
    return {
        name: {
            found
            for found in _imported(ast.parse(path.read_text(encoding="utf-8")), files)
            if found != name
        }
        for name, path in files.items()
    }


def circle(imports: dict[str, set[str]]) -> list[str]:
    """Return modules of which each imports the next, and the last is the first; [] if none do."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        # Each of these is imported by the next.
        return list(reversed(error.args[1]))
    return []


def _name(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(tree: ast.Module, known: Iterable[str]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            # Imports are absolute here, so each names its module.
            assert node.module is not None
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                name = inner if inner in known else node.module
                if name in known:
                    yield name


def main() -> int:
    """Print a circle, if there is one; return the exit status."""
    imports = imports_of(_ROOT, _PACKAGES)
    found = circle(imports)
    if found:
        print("modules import each other:\n  " + "\n  -> ".join(found), file=sys.stderr)
        return 1
    print(f"{len(imports)} modules, and no circle of imports")
    return 0


if __name__ == "__main__":
    sys.exit(main())
