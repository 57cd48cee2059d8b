"""What holds for all tests."""

import gc
import os

from hypothesis import settings
import pytest
from transports import use_transports

use_transports()

pytest_plugins = ["budgets"]


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for garbage in what tests make alone: not while they are collected, nor in modules.

    That takes a tenth of the time of collecting, and then as long for each look.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


# A machine may be busy: what takes long is told by the budgets, not by one case.
settings.register_profile("patient", parent=settings.default, deadline=None)
settings.load_profile("patient")


@pytest.fixture(scope="session", autouse=True)
def meshes_kept_apart(tmp_path_factory):
    """Keep results about meshes in a folder of the run, empty at first, for all its processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "meshes"
    folder.mkdir(mode=0o700, exist_ok=True)
    os.environ["SCENE_GRAPH_ROS_MESH_CACHE"] = str(folder)
    return folder
