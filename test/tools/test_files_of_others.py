"""Files, modules and pickles that somebody else named go through one door, or have a reason."""

import ast
from collections import Counter
from pathlib import Path

_ROOT = Path(__file__).parents[2]
_DOOR = "scene_graph_ros/geometry/files.py"
_CALLS = frozenset({
    "open", "fdopen", "read_text", "read_bytes", "fromfile", "loadtxt", "genfromtxt", "memmap",
    "import_module", "__import__", "exec", "eval", "exec_module", "run_path", "run_module",
    "safe_load", "full_load", "unsafe_load", "Unpickler", "np.load", "numpy.load", "yaml.load",
    "pickle.load", "pickle.loads", "marshal.loads", "trimesh.load", "ElementTree.parse",
})  # fmt: skip
"""What opens, imports or runs, by the name that is called; with a dot where that says enough."""

_OWN_NAME = "imports a module of ours, or of a library, whose name is in the source"
_OPENS_NO_FILE = "a method of ours called open: it opens topics"
_OWN_CACHE = "the user's own: whose file it is, and a digest, are checked first"
_OWN_SOURCE = "reads a source of this package"
_OWN_PACK = "part of the installation, as code is: who may write it, and digests, are checked"
_OWN_MESH = "a mesh that the user's own process has read, or the file that it just wrote"
_IN_MEMORY = "reads bytes that came through the door, with limits; opens no other file"

_ALLOWED = {
    f"{_DOOR}: os.open": "the door",
    "scene_graph_ros/geometry/compiled/kernel_files.py: open": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/kernel_files.py: os.open": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/kernel_files.py: os.fdopen": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/kernel_files.py: pickle.loads": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/claims.py: os.open": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/lean_code.py: pickle.loads": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/kernel_packs.py: path.open": _OWN_PACK,
    "scene_graph_ros/geometry/compiled/kernel_packs.py: pickle.loads": _OWN_PACK,
    "scene_graph_ros/geometry/compiled/pack_writer.py: pickle.loads": _OWN_CACHE,
    "scene_graph_ros/geometry/compiled/sources.py: path.read_bytes": _OWN_SOURCE,
    "scene_graph_ros/client/parameters.py: yaml.safe_load": "a value that the user typed",
    "scene_graph_ros/scene_files/saved_check.py: read_bytes": _OWN_MESH,
    "scene_graph_ros/scene_files/saved_values.py: file.read_bytes": _OWN_MESH,
    "scene_graph_ros/geometry/compiled/dispatch.py: exec": "code that is written there",
    "scene_graph_ros/geometry/meshes/io.py: trimesh.load": _IN_MEMORY,
    "scene_graph_ros/geometry/meshes/texture_coordinates.py: trimesh.load": _IN_MEMORY,
    "scene_graph_ros/geometry/meshes/textures.py: Image.open": _IN_MEMORY,
    "scene_graph_ros/geometry/perception/gltf/answers.py: Image.open": _IN_MEMORY,
    "scene_graph_ros/convex/iris/regions_yaml.py: yaml.safe_load": _IN_MEMORY,
    "scene_graph_ros/convex/typed_yaml.py: yaml.safe_load": "text that the user gives",
    "scene_graph_ros/geometry/meshes/other_process.py: np.load": "what its own process wrote",
    "scene_graph_ros/geometry/kept_results.py: os.fdopen": _OWN_CACHE,
    "scene_graph_ros/geometry/meshes/solids/kept_solid.py: read_bytes": _OWN_SOURCE,
    "scene_graph_ros/geometry/kept_results.py: np.load": _OWN_CACHE,
    "scene_graph_ros/planning/checker/carried_checker.py: pickle.loads": (
        "it came as part of a pickle, which the user's own executor has unpickled"
    ),
    "scene_graph_ros/node/services/region_files.py: os.fdopen": "writes a file of regions_folder",
    "scene_graph_ros/node/effects/page_file.py: os.open": "writes a file that is new",
    "scene_graph_ros/node/effects/page_file.py: os.fdopen": "writes a file that is new",
    "scene_graph_ros/node/runtime/ending.py: read_text": "what the kernel says of its own threads",
    "scene_graph_ros/node/runtime/spread_imports.py: os.open": "a library that is imported next",
    "scene_graph_ros/node/recording/bag.py: self._writer.open": "makes a folder, the user's own",
    "scene_graph_ros/node/recording/bag.py: read_text": "messages that this project installed",
    "scene_graph_ros/replay/reader.py: self.path.open": "the user's own call, in parts",
    "scene_graph_ros/replay/page.py: path.open": "writes a file that the user named",
    "scene_graph_ros/views/browser/gate.py: file.read_bytes": "files of the page, by their names",
    "scene_graph_ros/views/browser/page_file.py: read_text": "files of the page, by their names",
    "msg_adapters/definitions.py: path.read_text": "definitions that installed packages have",
    "msg_adapters/message_classes.py: importlib.import_module": (
        "the door for kinds of messages: packages that the ament index has"
    ),
    "scene_graph_ros/node/effects/camera.py: _Transforms.open": _OPENS_NO_FILE,
    "scene_graph_ros/node/server.py: self._diagnostics.open": _OPENS_NO_FILE,
    "scene_graph_ros/node/server.py: self._effects.open": _OPENS_NO_FILE,
    "scene_graph_ros/node/world/imported_types.py: importlib.import_module": (
        "kinds of POSE_TOPICS and maps alone"
    ),
} | {
    f"{path}: importlib.import_module": _OWN_NAME
    for path in (
        "scene_graph_ros/ask.py",
        "scene_graph_ros/convex/solve/iteration_callback.py",
        "scene_graph_ros/convex/solve/smooth_program.py",
        "scene_graph_ros/geometry/__init__.py",
        "scene_graph_ros/geometry/query/distance/fcl_engine.py",
        "scene_graph_ros/geometry/query/on_demand.py",
        "scene_graph_ros/lazy_names.py",
        "scene_graph_ros/node/effects/camera.py",
        "scene_graph_ros/node/effects/state.py",
        "scene_graph_ros/node/services/plan_action.py",
        "scene_graph_ros/node/services/queries.py",
        "scene_graph_ros/planning/paths/ompl_bridge/ompl_library.py",
        "scene_graph_ros/planning/optimal_control/casadi_backend.py",
        "scene_graph_ros/trajectories/retimers/retimer_libraries.py",
        "scene_graph_ros/warmup/pack.py",
        "scene_graph_ros/warmup/task.py",
    )
}  # fmt: skip
_PLACES = {tuple(place.split(": ")) for place in _ALLOWED}


def _found() -> Counter[tuple[str, str]]:
    """Count the calls of the product's sources that open, import or run, by file and name."""
    found: Counter[tuple[str, str]] = Counter()
    for top in ("scene_graph_ros", "msg_adapters", "launch"):
        for path in sorted((_ROOT / top).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call):
                    whole = ast.unparse(node.func)
                    last = whole.rpartition(".")[2]
                    if whole in _CALLS or last in _CALLS:
                        found[str(path.relative_to(_ROOT)), whole] += 1
    return found


def _is_allowed(file: str, call: str) -> bool:
    last = call.rpartition(".")[2]
    return (file, call) in _PLACES or (file, last) in _PLACES


def test_all_that_opens_or_imports_goes_through_the_door_or_has_a_reason():
    """A new place goes through `read_limited`, or comes into the list with its reason."""
    strange = [f"{file}: {call}" for file, call in _found() if not _is_allowed(file, call)]
    assert strange == []


def test_the_list_has_no_place_that_is_no_more():
    """Each entry stands for a call."""
    calls = set(_found())
    calls |= {(file, call.rpartition(".")[2]) for file, call in calls}
    assert sorted(": ".join(place) for place in _PLACES - calls) == []
