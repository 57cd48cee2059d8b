"""A ROS domain for examples that are run."""

from domains import own_domain
from node_harness import environment
import pytest


@pytest.fixture
def surroundings():
    """The environment of processes that talk to each other and to nobody else."""
    with own_domain() as domain:
        yield environment(domain)
