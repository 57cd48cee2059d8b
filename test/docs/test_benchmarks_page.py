"""The page of benchmarks lists each command, and `make` runs what it says."""

from pathlib import Path
import re

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "benchmarks.md").read_text()
ROWS = re.findall(r"^\| `python -m (benchmarks[\w.]*)`( \*)? \|", PAGE, re.M)


def commands():
    """Return the modules that are run as commands by people."""
    found = set()
    for path in (ROOT / "benchmarks").rglob("*.py"):
        if '__name__ == "__main__"' in path.read_text():
            parts = path.relative_to(ROOT).with_suffix("").parts
            found.add(".".join(part for part in parts if part != "__main__"))
    return found


def test_every_command_is_listed():
    """But for processes that others start, and parts of `benchmarks.messages`."""
    parts = {name for name in commands() if name.startswith("benchmarks.messages.")}
    assert {name for name, _ in ROWS} == (commands() - parts) | {"benchmarks.messages.soak"}


def test_make_runs_what_the_page_says():
    """`make bench` the first sixteen, `make accuracy` those with a star."""
    makefile = (ROOT / "Makefile").read_text()
    run = {
        target: re.findall(
            r"-m (benchmarks[\w.]*)", makefile.split(f"\n{target}:")[1].split("\n\n")[0]
        )
        for target in ("bench", "accuracy")
    }
    assert run["bench"] == [name for name, _ in ROWS[:16]]
    assert run["accuracy"] == [name for name, star in ROWS if star]
