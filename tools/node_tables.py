"""Write the tables of docs/node.md that the code knows: `python -m tools.node_tables`.

Each stands between two comments, ``<!-- parameters -->`` and ``<!-- end -->``. Nothing of ROS is
needed for parameters; services are read from their definitions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
import re

from scene_graph_ros.node.runtime.names import service_name
from scene_graph_ros.node.runtime.parameter import Parameter
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.world.edits import EDITS

__all__ = ["TABLES", "parameters", "services", "written"]

_ROOT = Path(__file__).resolve().parents[1]
_PAGE = _ROOT / "docs" / "node.md"
_SERVICES = _ROOT / "scene_graph_msgs" / "srv"
_TYPES = {bool: "bool", int: "int", float: "double", str: "string"}


def parameters() -> list[str]:
    """Return a row for each parameter of the node."""
    head = ["parameter", "type", "default", "allowed", "meaning"]
    return _table(head, [_parameter(parameter) for parameter in PARAMETERS])


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]


def _parameter(parameter: Parameter) -> list[str]:
    default = parameter.default
    return [
        f"`{parameter.name}`",
        _TYPES[type(default)],
        f'`"{default}"`' if isinstance(default, str) else f"`{_number(default)}`",
        _allowed(parameter),
        parameter.description + (" *At start only.*" if parameter.read_only else ""),
    ]


def _number(value: float) -> str:
    """Return a number as YAML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int) else f"{value:.12g}" + ".0" * value.is_integer()


def _allowed(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"`{choice}`" for choice in parameter.choices)
    bounds = (parameter.minimum, parameter.maximum)
    return " to ".join(f"{bound:.12g}" for bound in bounds if bound is not None)


def services(*, are_edits: bool) -> list[str]:
    """Return a row for each service that changes the scene, or for each of the others."""
    paths = [p for p in sorted(_SERVICES.glob("*.srv")) if (p.stem in EDITS) == are_edits]
    rows = [[f"`{service_name(path.stem)}`", _summary(path.read_text())] for path in paths]
    return _table(["service", "what it does"], rows)


def _summary(definition: str) -> str:
    """Return the first sentence of the comment that a definition begins with."""
    comment = re.match(r"(#.*\n)+", definition)
    assert comment, "a definition begins with what the service does"
    text = " ".join(line.lstrip("# ") for line in comment.group().splitlines())
    return re.split(r"(?<=\.) ", text)[0]


TABLES: dict[str, Callable[[], list[str]]] = {
    "parameters": parameters,
    "services that ask": partial(services, are_edits=False),
    "services that change": partial(services, are_edits=True),
}


def written(page: str) -> str:
    """Return the text of the page with its tables as they are now."""
    for name, table in TABLES.items():
        text = f"<!-- {name} -->\n\n" + "\n".join(table()) + "\n\n<!-- end -->"
        place = rf"<!-- {name} -->\n.*?<!-- end -->"
        page, count = re.subn(place, text.replace("\\", r"\\"), page, flags=re.DOTALL)
        if count != 1:
            raise SystemExit(f"docs/node.md has {count} places for the table '{name}', not 1")
    return page


if __name__ == "__main__":
    _PAGE.write_text(written(_PAGE.read_text()))
