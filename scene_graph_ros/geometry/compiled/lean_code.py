"""Machine code of a kernel without the parts for callers that are compiled anew.

Numba keeps three things of a kernel: its machine code, its bitcode, from which it is merged into
whoever calls it from compiled code, and its annotated source. The bitcode is twice as large as the
code and takes nine tenths of the time of loading it, and a call from Python needs neither. So the
bitcode is kept apart, and read when something that calls the kernel is compiled. Where it is not
kept at all, or gone, the kernel is compiled anew for its callers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import llvmlite.binding
from numba.core import event
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys

__all__ = ["Bitcode", "LeanCode", "lean_code", "make_linkable", "no_bitcode", "rebuild"]

LeanCode = dict[str, Any]
"""A kernel as it is kept to be called from Python."""
Bitcode = Callable[[], bytes | None]
"""Reads a kernel's bitcode; None where it is not kept."""


def no_bitcode() -> None:
    """Return None: there is no bitcode."""


def lean_code(reduced: tuple[Any, ...]) -> tuple[LeanCode, bytes]:
    """Divide numba's data of a kernel into the part for calls from Python, and bitcode."""
    (name, _, (machine_code, bitcode)), fndesc, environment, signature, *rest = reduced
    objectmode, lifted, _, reload_init, referenced_envs = rest
    assert not objectmode
    assert not lifted
    return {
        "name": name,
        "machine_code": machine_code,
        "symbols": _symbols_of_others(llvmlite.binding.parse_bitcode(bitcode)),
        "fndesc": fndesc,
        "environment": environment,
        "signature": signature,
        "reload_init": reload_init,
        "referenced_envs": referenced_envs,
    }, bitcode


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
    """A library of numba's that reads its bitcode when a caller is compiled."""

    def __init__(self, codegen: Any, kept: LeanCode, bitcode: Bitcode) -> None:
        super().__init__(codegen, kept["name"])
        self._shared_module: Any = None
        self._bitcode = bitcode
        self.enable_object_caching()
        self._set_compiled_object(kept["machine_code"])
        self._finalize_final_module()
        fndesc = kept["fndesc"]
        names = (fndesc.llvm_cpython_wrapper_name, fndesc.llvm_func_name)
        codegen._engine._defined_symbols.update(names)

    def is_linkable(self) -> bool:
        """Tell whether the bitcode is there; read it."""
        if self._shared_module is None:
            bitcode = self._bitcode()
            if bitcode is None:
                return False
            self._shared_module = llvmlite.binding.parse_bitcode(bitcode)
            self.codegen._engine._load_defined_symbols(self._shared_module)
        return True


def rebuild(target_context: Any, kept: LeanCode, bitcode: Bitcode) -> CompileResult:
    """Return a kernel of kept code.

    Raises the errors of numba and LLVM for other data.
    """
    _prepare(target_context, kept["symbols"])
    for initialize in kept["reload_init"]:
        initialize()
    library = _LeanLibrary(target_context.codegen(), kept, bitcode)
    known: dict[str, Any] = dict.fromkeys(CompileResult._fields)
    known.update(
        typing_context=target_context.typing_context,
        target_context=target_context,
        library=library,
        entry_point=target_context.get_executable(library, kept["fndesc"], kept["environment"]),
        type_annotation="",
        objectmode=False,
        lifted=(),
        **{name: kept[name] for name in kept if name in CompileResult._fields},
    )
    for environment in kept["referenced_envs"]:
        library.codegen.set_env(environment.env_name, environment)
    return CompileResult(**known)


def _is_linkable(result: Any) -> bool:
    library = getattr(result, "library", None)
    return not isinstance(library, _LeanLibrary) or library.is_linkable()


def make_linkable(dispatcher: Any, args: tuple[Any, ...]) -> None:
    """Compile a kernel anew for its callers if it was loaded and there is no bitcode of it.

    Calls from Python go on with the code that was loaded.
    """
    loaded = dispatcher.overloads.get(args)
    if _is_linkable(loaded):
        return
    whole = dispatcher._cache.load_linkable(args, dispatcher.targetctx)
    if whole is None or not _is_linkable(whole):
        dispatcher._cache_misses[args] += 1
        told = {"dispatcher": dispatcher, "args": args, "return_type": None}
        with event.trigger_event("numba:compile", data=told):
            whole = dispatcher._compiler.compile(args, None)
        dispatcher._cache.save_overload(args, whole)
    dispatcher.targetctx.insert_user_function(whole.entry_point, whole.fndesc, [whole.library])
    dispatcher.overloads[args] = whole
