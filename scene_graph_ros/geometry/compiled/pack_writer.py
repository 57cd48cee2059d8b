"""Write a pack of the kernels that are in the cache: `kernel_packs` has its format."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import json
from pathlib import Path
import pickle
from typing import NamedTuple

from numba.core import serialize
import numba.core.config as numba_config

from scene_graph_ros.geometry.compiled.cache import (
    cache_root,
    digest_of_everything,
    folder_of,
    is_for_callers,
)
from scene_graph_ros.geometry.compiled.kernel_files import KernelFiles
from scene_graph_ros.geometry.compiled.kernel_packs import (
    BASELINES,
    digest_of,
    first_line,
    made_for,
    Place,
)

__all__ = ["Contents", "pack_kernels", "write_pack"]


def pack_kernels(path: Path, modules: Iterable[str], groups: Iterable[str]) -> int:
    """Write the kernels of these modules that this process would load; return how many.

    All of the groups have to be compiled, for the baseline that NUMBA_CPU_NAME names.
    """
    baseline = numba_config.CPU_NAME
    if baseline not in BASELINES or numba_config.CPU_FEATURES != "":
        raise ValueError(
            f"kernels are packed for {', '.join(BASELINES)}, not for {baseline}: "
            "set NUMBA_CPU_NAME to one of them, and NUMBA_CPU_FEATURES to nothing"
        )
    functions = {}
    folders = {module: folder_of(module) for module in modules}
    for folder in (cache_root() / name for name in sorted(folders.values())):
        for index in sorted(folder.glob("*.nbi")):
            files = KernelFiles(str(folder), index.stem, None)
            kernels = {
                _without_processor(key, baseline): code
                for key, code in files.packed().items()
                if not is_for_callers(pickle.loads(key))  # noqa: S301 - as below
            }
            if kernels:
                functions[f"{folder.name}/{index.stem}"] = kernels
    digests = dict.fromkeys(groups, digest_of_everything())
    there = {module: name for module, name in folders.items() if (cache_root() / name).exists()}
    write_pack(path, Contents(baseline, digests, there, functions))
    return sum(map(len, functions.values()))


def _without_processor(packed: bytes, baseline: str) -> bytes:
    """Return a key of the cache without the processor, which a pack is for as a whole."""
    *key, (_, name, features) = pickle.loads(packed)  # noqa: S301 - of an index that was checked
    if (name, features) != (baseline, ""):
        raise ValueError(f"{cache_root()} has kernels for {name}, too: remove it")
    return bytes(serialize.dumps(tuple(key)))


class Contents(NamedTuple):
    """A pack's contents."""

    baseline: str
    groups: Mapping[str, str]
    """Groups whose kernels are all among them, with the digest of everything."""
    modules: Mapping[str, str]
    """Modules whose kernels are among them, with their folder."""
    functions: Mapping[str, Mapping[bytes, bytes]]
    """Kernels by their pickled key, of functions by ``folder/base``."""


def write_pack(path: Path, contents: Contents) -> None:
    """Write a pack."""
    parts: list[bytes] = []
    size = 0

    def place(content: bytes) -> Place:
        nonlocal size
        parts.append(content)
        size += len(content)
        return Place(size - len(content), len(content), digest_of(content))

    places = {}
    for name, kernels in sorted(contents.functions.items()):
        rows = [(key, tuple(place(code))) for key, code in sorted(kernels.items())]
        places[name] = place(pickle.dumps(rows))
    told = {**contents._asdict(), "functions": places, "made for": made_for()}
    head = json.dumps(told).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"".join([first_line(head), head, *parts]))
