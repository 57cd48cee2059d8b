"""Regions as YAML, in and out; imported when that is first asked for."""

from __future__ import annotations

import os
from pathlib import Path
import tempfile
from typing import Any

from msg_adapters.errors import MessageError, TooLargeError, UnavailableError
from scene_graph_ros.convex.iris.regions_yaml import (
    regions_from_document,
    regions_to_yaml,
)
from scene_graph_ros.geometry.errors import NameConflictError
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.services.region_queries import ignored_geometry, kept_region
from scene_graph_ros.scene_files.yaml_document import parse_yaml

__all__ = ["load_regions", "save_regions"]

_ENDINGS = (".yaml", ".yml")


def load_regions(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer LoadRegions."""
    if bool(request.resource) == bool(request.text):
        raise MessageError("either resource or text says the regions, and the other is empty")
    where, text = scope.text(request.resource) if request.resource else ("text", request.text)
    document = parse_yaml(text, where, is_quoted=not request.resource).data
    found = regions_from_document(document, where, request.child_name or None)
    ignored, kept = ignored_geometry(request.ignored, scope), []
    for name, region in found.items():
        if region.ambient_dimension != 3:
            raise MessageError(
                f"{where}: {quoted(name)} has {region.ambient_dimension} dimensions; what is kept"
                " here is a region of the world, which has 3"
            )
        whole = canonical_name("region", request.prefix + name)
        kept.append(kept_region(whole, region, ignored, where, scope))
    most = scope.limit("max_regions")
    scope.regions().keep(kept, replace=request.replace, most=most)
    response.names = [each.name for each in kept]


def save_regions(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer SaveRegions."""
    kept = scope.regions().named(request.names)
    faces = sum(len(each.region.b) for each in kept)
    scope.require("max_rows_per_response", faces, "faces of the regions")
    regions = {each.name: each.region for each in kept}
    text = regions_to_yaml(regions, request.child_name or None)
    if len(text) > MAX_TEXT_BYTES:
        raise TooLargeError(
            f"names: the regions take {len(text)} characters, and {MAX_TEXT_BYTES} can be read"
        )
    response.text = text
    if request.file:
        response.path = str(_write(request.file, text, bool(request.replace), scope))


def _write(file: str, text: str, replace: bool, scope: QueryScope) -> Path:
    """Write a file of the folder for regions as a whole, or not at all; return its path."""
    folder = scope.limit("regions_folder")
    if not folder:
        raise UnavailableError("the parameter regions_folder names no folder to write files to")
    is_plain = file.isprintable() and not file.startswith(".") and Path(file).name == file
    if not is_plain or not file.endswith(_ENDINGS) or len(file) > 255:
        raise MessageError(
            f"file must be the name of a file in regions_folder that ends with .yaml or .yml, not"
            f" {quoted(file)}"
        )
    path = Path(folder) / file
    try:
        handle, unfinished = tempfile.mkstemp(prefix=".regions", dir=folder, text=True)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as stream:
                stream.write(text)
                stream.flush()
                os.fsync(stream.fileno())  # else a power cut may leave an empty file in its place
            Path(unfinished).chmod(0o644)
            if replace:
                Path(unfinished).replace(path)
            else:
                # Fails where the name is taken, also by something that came just now.
                os.link(unfinished, path)
        finally:
            Path(unfinished).unlink(missing_ok=True)
    except FileExistsError:
        raise NameConflictError(
            f"file {quoted(file)} is there already; it is replaced where replace is true"
        ) from None
    except OSError as error:
        raise UnavailableError(f"{path} can't be written: {error.strerror}") from None
    return path
