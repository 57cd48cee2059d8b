"""What is installed is listed completely, with hashes, and is what requirements ask for."""

from pathlib import Path
import re

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
import pytest

FOLDER = Path(__file__).parents[2] / "requirements"
# What each list is made from, as `make lock` says.
PARTS = {
    "build": ("build",),
    "core": ("core", "test"),
    "docs": ("docs",),
    "peers": ("peers",),
    "project": ("core", "extras", "ros", "dev", "test"),
    "workspace": ("workspace",),
}


def locked(name):
    """Return version and number of hashes of each package of a list, by name."""
    text = (FOLDER / "locked" / f"{name}.txt").read_text().replace("\\\n", " ")
    found = {}
    for line in text.splitlines():
        what, *hashes = line.split("--hash=")
        requirement = Requirement(what)
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}\s*", entry) for entry in hashes)
        versions = [s.version for s in requirement.specifier if s.operator == "=="]
        assert len(versions) == 1, f"{requirement} of {name} is not pinned"
        found[canonicalize_name(requirement.name)] = (versions[0], len(hashes))
    return found


def test_each_environment_has_a_list():
    """No list is forgotten, here or in the folder."""
    assert {file.stem for file in (FOLDER / "locked").iterdir()} == set(PARTS)


@pytest.mark.parametrize("name", PARTS)
def test_a_list_has_hashes_and_no_hosts(name):
    """Each package has a hash at least; where it comes from is the business of the machine."""
    assert all(count > 0 for _, count in locked(name).values())
    assert "://" not in (FOLDER / "locked" / f"{name}.txt").read_text()


@pytest.mark.parametrize("name", PARTS)
def test_a_list_holds_what_is_required(name):
    """`make lock` was run after the last change of the files that it reads."""
    versions = locked(name)
    for part in PARTS[name]:
        for line in (FOLDER / f"{part}.txt").read_text().splitlines():
            text = line.partition("#")[0].strip()
            if text and not text.startswith("-"):
                required = Requirement(text)
                version, _ = versions[canonicalize_name(required.name)]
                assert required.specifier.contains(version), f"{required} of {part}.txt"


def test_lists_agree():
    """Lists that are installed into one environment have one version of each package."""
    together = {}
    for name in ("build", "project", "docs", "peers", "workspace"):
        for package, (version, _) in locked(name).items():
            assert together.setdefault(package, version) == version
