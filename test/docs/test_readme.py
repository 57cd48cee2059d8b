"""The README says what is true: its example prints what it shows, its table is the node's."""

from pathlib import Path
import re
import subprocess
import sys

from scene_graph_ros.node.runtime.names import service_name
from scene_graph_ros.node.runtime.parameters import PARAMETERS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def _block_after(heading: str, language: str) -> str:
    """Return the first code block of ``language`` below ``heading``."""
    section = README.split(f"## {heading}\n", 1)[1]
    match = re.search(rf"```{language}\n(.*?)```", section, re.S)
    assert match, f"no {language or 'plain'} block below '{heading}'"
    return match.group(1)


def test_the_core_example_prints_what_the_readme_shows():
    """The ten lines run as they stand and print the block below them."""
    code = _block_after("The core in ten lines", "python")
    shown = README.split(code, 1)[1].split("```\n", 3)[2]
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert result.stdout == shown


def test_the_node_example_is_valid_and_publishes():
    """The node's ten lines compile and end with publishing on the source's pose topic."""
    code = _block_after("The node in ten lines", "python")
    compile(code, "README.md", "exec")
    assert '"objects/poses"' in code
    assert code.rstrip().endswith("publisher.publish(message)")


def test_the_table_of_parameters_is_the_node_s():
    """Every parameter stands in the README with its description, and no other."""
    rows = dict(re.findall(r"^\| `(\w+)` \| `.*?` \| (.*?) \|$", README, re.M))
    described = {
        p.name: p.description + (" Read-only." if p.read_only else "") for p in PARAMETERS
    }
    assert rows == described


def test_every_service_of_the_definitions_is_listed():
    """The services named in the README are those of scene_graph_msgs."""
    defined = {
        service_name(path.stem)[2:] for path in (ROOT / "scene_graph_msgs/srv").glob("*.srv")
    }
    section = README.split("### Services\n", 1)[1].split("### ", 1)[0]
    table = "\n".join(line for line in section.splitlines() if line.startswith("|"))
    assert set(re.findall(r"`(\w+)`", table)) == defined
