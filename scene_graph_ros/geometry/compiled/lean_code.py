"""Machine code of a kernel without the parts for callers that are compiled anew.

Numba keeps three things of a kernel: its machine code, its bitcode, from which it is merged into
whoever calls it from compiled code, and its annotated source. The bitcode is twice as large as the
code and takes nine tenths of the time of loading it, and a call from Python needs neither. So the
bitcode is kept apart, and read when something that calls the kernel is compiled. Where it is not
kept at all, or gone, the kernel is compiled anew for its callers.
"""

from __future__ import annotations

import pickle
from typing import Any

import llvmlite.binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys

from scene_graph_ros.geometry.compiled.callee_code import (
    CalleeLibrary,
    EntryPoint,
    environments_of,
    LateCode,
)

__all__ = ["LeanCode", "has_bitcode", "lean_callee", "lean_code", "rebuild", "rebuild_callee"]

LeanCode = dict[str, Any]
"""A kernel as it is kept, without its bitcode."""


def lean_code(reduced: tuple[Any, ...]) -> tuple[LeanCode, bytes]:
    """Divide numba's data of a kernel into the part for calls from Python, and bitcode."""
    (name, _, (machine_code, bitcode)), fndesc, environment, signature, *rest = reduced
    objectmode, lifted, _, reload_init, referenced_envs = rest
    assert not objectmode
    assert not lifted
    module = llvmlite.binding.parse_bitcode(bitcode)
    return {
        "name": name,
        "machine_code": machine_code,
        "symbols": _symbols_of_others(module),
        "fndesc": fndesc,
        "environment": environment,
        "signature": signature,
        "reload_init": reload_init,
        "referenced_envs": referenced_envs,
    }, pickle.dumps((LateCode(bitcode, environments_of(module)),))


def lean_callee(result: CompileResult) -> tuple[LeanCode, bytes]:
    """Divide a kernel that only callers are compiled with in the same way."""
    fndesc = result.fndesc
    fndesc.typemap = fndesc.calltypes = None  # as numba does: they may fail to be pickled
    return {
        "name": result.library.name,
        "fndesc": fndesc,
        "environment": result.environment,
        "signature": result.signature,
        "reload_init": result.reload_init,
        "referenced_envs": result.library.environments(),
    }, pickle.dumps(result.library.whole)


def _symbols_of_others(module: Any) -> list[str]:
    """Name the functions and variables that code asks for and does not define."""
    named = (*module.functions, *module.global_variables)
    names = {each.name for each in named if each.is_declaration}
    return sorted(name for name in names if not name.startswith("llvm."))


def _prepare(target_context: Any, symbols: list[str]) -> None:
    """Have all that a kernel's code asks for in this process.

    To compile, numba first imports and registers all that it has, which takes longer than all
    else of a first answer; code that is loaded hardly ever needs more than its memory manager.
    """
    rtsys.initialize(target_context)
    if not all(map(llvmlite.binding.address_of_symbol, symbols)):
        target_context.refresh()


class _LeanLibrary(JITCodeLibrary):
    """A library of numba's that has machine code alone."""

    def __init__(self, codegen: Any, kept: LeanCode) -> None:
        super().__init__(codegen, kept["name"])
        self.enable_object_caching()
        self._set_compiled_object(kept["machine_code"])
        self._finalize_final_module()
        fndesc = kept["fndesc"]
        names = (fndesc.llvm_cpython_wrapper_name, fndesc.llvm_func_name)
        codegen._engine._defined_symbols.update(names)


def has_bitcode(result: CompileResult) -> bool:
    """Tell whether callers can be compiled with a kernel: not if its machine code was loaded."""
    return not isinstance(result.library, _LeanLibrary)


def rebuild(target_context: Any, kept: LeanCode) -> CompileResult:
    """Return a kernel of kept code, which Python may call.

    Raises the errors of numba and LLVM for other data.
    """
    _prepare(target_context, kept["symbols"])
    library = _LeanLibrary(target_context.codegen(), kept)
    entry_point = target_context.get_executable(library, kept["fndesc"], kept["environment"])
    for environment in kept["referenced_envs"]:
        library.codegen.set_env(environment.env_name, environment)
    return _result(target_context, kept, library, entry_point)


def rebuild_callee(target_context: Any, kept: LeanCode, bitcode: bytes) -> CompileResult:
    """Return a kernel that callers may be compiled with; raises as `rebuild` does."""
    whole = pickle.loads(bitcode)  # noqa: S301 - of a file that was checked
    function = kept["fndesc"].llvm_func_name
    library = CalleeLibrary.of_kept(target_context.codegen(), kept["name"], whole, function)
    library._reload_init.update(kept["reload_init"])
    return _result(target_context, kept, library, EntryPoint())


def _result(
    target_context: Any, kept: LeanCode, library: JITCodeLibrary, entry_point: Any
) -> CompileResult:
    for initialize in kept["reload_init"]:
        initialize()
    known: dict[str, Any] = dict.fromkeys(CompileResult._fields)
    known.update(
        typing_context=target_context.typing_context,
        target_context=target_context,
        library=library,
        entry_point=entry_point,
        type_annotation="",
        objectmode=False,
        lifted=(),
        **{name: kept[name] for name in kept if name in CompileResult._fields},
    )
    return CompileResult(**known)
