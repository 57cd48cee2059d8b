"""Kernels as other kernels call them: bitcode, which is merged into the code of the caller.

Numba compiles each kernel that another one calls as if Python called it, too: it writes a wrapper
that takes Python's objects apart, and machine code of both, of which the caller has its own copy.
Most kernels are called by kernels alone, so here they are only compiled to bitcode. Once Python
calls one of them, it is compiled as a whole (`kernel`).

Every layer of calls would optimize all layers below it once more. A kernel that is too large to be
inlined gains nothing by that: its callers declare it, and its code is merged where Python calls.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any, NamedTuple

import llvmlite.binding
from numba.core import compiler, event, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock, require_global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.environment import lookup_environment

from scene_graph_ros.geometry.compiled.slice_errors import with_short_slice_errors

__all__ = [
    "CalleeLibrary",
    "Callees",
    "EntryPoint",
    "Kept",
    "LateCode",
    "environments_of",
    "link_environments",
]


class EntryPoint:
    """The key by which numba finds a kernel that is called from compiled code."""


_LARGE = 16_000
"""Bytes of bitcode. LLVM inlines no function of so much at a call among several."""


class LateCode(NamedTuple):
    """The code of a large kernel, for the entry points of all that call it."""

    bitcode: bytes
    environments: tuple[str, ...]
    """The names of numba's environments that it asks for."""


class CalleeLibrary(JITCodeLibrary):
    """A library of numba's that is linked into others, and has no machine code of its own."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.is_inlined = False
        """Whether LLVM is told to inline the kernel into its callers."""
        self.late: tuple[LateCode, ...] = ()
        """The code that is declared here, callers before what they call."""

    def finalize(self) -> None:
        """Link and optimize all code but that of large kernels."""
        require_global_compiler_lock()
        self._raise_if_finalized()
        late: list[LateCode] = []
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            if isinstance(library, CalleeLibrary):
                self._dynamic_globals += library._dynamic_globals
                late += library.whole if library.is_large else library.late
                if library.is_large:
                    continue
            self._final_module.link_in(_own_module(library), preserve=True)
        # The last one of each: what it calls comes after it.
        self.late = tuple(dict.fromkeys(reversed(late)))[::-1]
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    @classmethod
    def of_kept(
        cls, codegen: Any, name: str, whole: tuple[LateCode, ...], function: str
    ) -> CalleeLibrary:
        """Return a library of kept code; its own comes first, and has the kernel's function."""
        library = cls(codegen, name)
        library.late = whole[1:]
        library._final_module = module = llvmlite.binding.parse_bitcode(whole[0].bitcode)
        library.is_inlined = any(
            b"alwaysinline" in each for each in module.get_function(function).attributes
        )
        library._finalize_final_module()
        return library

    @functools.cached_property
    def own(self) -> LateCode:
        """The code without that of large kernels."""
        return LateCode(_own_module(self).as_bitcode(), environments_of(self._final_module))

    @property
    def whole(self) -> tuple[LateCode, ...]:
        """All code, callers before what they call."""
        return self.own, *self.late

    @property
    def is_large(self) -> bool:
        """Whether callers declare it only."""
        return not self.is_inlined and len(self.own.bitcode) >= _LARGE

    def _get_module_for_linking(self) -> Any:
        """Return all code as one module, which numba links into an entry point's."""
        module = _own_module(self)
        if self.late:
            module = module.clone()
            for late in self.late:
                module.link_in(llvmlite.binding.parse_bitcode(late.bitcode))
        return module

    def environments(self) -> tuple[Any, ...]:
        """Return the environments that the code asks for, of those that can be kept."""
        names = dict.fromkeys(name for code in self.whole for name in code.environments)
        found = map(lookup_environment, names)
        return tuple(each for each in found if each is not None and each.can_cache())


def _own_module(library: JITCodeLibrary) -> Any:
    """Return the module of a library that others link, without code that is linked late."""
    return JITCodeLibrary._get_module_for_linking(library)


def environments_of(module: Any) -> tuple[str, ...]:
    """Return the names of numba's environments that a module asks for."""
    names = (variable.name for variable in module.global_variables)
    return tuple(name for name in names if name.startswith("_ZN08NumbaEnv"))


class _CalleeCompiler(_FunctionCompiler):
    """Compiles a kernel to bitcode, optimized and without a wrapper for Python."""

    def _customize_flags(self, flags: Any) -> Any:
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        return flags

    def _compile_core(self, args: tuple[Any, ...], return_type: Any) -> Any:
        flags = compiler.Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        target = self.targetdescr.target_context
        library = CalleeLibrary(target.codegen(), self.py_func.__qualname__)
        library.is_inlined = self.targetoptions.get("forceinline", False)
        result = compiler.compile_extra(
            self.targetdescr.typing_context,
            target,
            self.py_func,
            args=args,
            return_type=return_type,
            flags=self._customize_flags(flags),
            locals=self.locals,
            library=library,
            pipeline_class=self.pipeline_class,
        )
        library.finalize()
        return result._replace(entry_point=EntryPoint(), reload_init=[*library._reload_init])


class Kept(NamedTuple):
    """The functions that keep a function's kernels."""

    has_bitcode: Callable[[Any], bool]
    """Whether callers can be compiled with a kernel that Python calls."""
    load: Callable[[Any, Any], Any]
    """Returns a kernel for types, or None: then no other process compiles it until the release."""
    save: Callable[[Any, Any], None]
    release: Callable[[], None]


class Callees:
    """The kernels of one function that its callers are compiled with, by types of arguments."""

    def __init__(self, dispatcher: Any, kept: Kept) -> None:
        """Take the kept kernels of a dispatcher, and keep those that are compiled."""
        self._dispatcher, self._kept = dispatcher, kept
        self.results: dict[tuple[Any, ...], Any] = {}
        """As numba describes them."""

    @functools.cached_property
    def _compiler(self) -> _CalleeCompiler:
        """Made when first asked for: a process declares far more kernels than it compiles."""
        dispatcher = self._dispatcher
        return _CalleeCompiler(
            dispatcher.py_func,
            dispatcher.targetdescr,
            dispatcher.targetoptions,
            dispatcher.locals,
            compiler.Compiler,
        )

    def call_template(self, args: Any, kws: Any) -> Any:
        """Return numba's template of a call with arguments of these types."""
        signature, folded = self._compiler.fold_argument_types(args, kws)
        self.require(tuple(folded))
        name = self._dispatcher.py_func.__name__
        known = [result.signature for result in self.results.values()]
        return typing.make_concrete_template(name, name, known), signature, folded, {}

    def entry_point(self, args: Any) -> Any:
        """Return the key by which numba finds the kernel for these types."""
        return self.results[tuple(args)].entry_point

    def require(self, args: tuple[Any, ...]) -> None:
        """Load a kernel for types of arguments, or compile it."""
        if args in self.results:
            return
        dispatcher = self._dispatcher
        compiled = dispatcher.overloads.get(args)
        if compiled is not None and self._kept.has_bitcode(compiled):
            self.results[args] = compiled
            return
        # Numba tells a kernel that calls itself by the count.
        with global_compiler_lock, dispatcher._compiling_counter:
            try:
                result = self._kept.load(args, dispatcher.targetctx)
                if result is None:
                    result = self._compile(args)
            finally:
                self._kept.release()
        dispatcher.targetctx.insert_user_function(
            result.entry_point, result.fndesc, [result.library]
        )
        self.results[args] = result

    def _compile(self, args: tuple[Any, ...]) -> Any:
        self._dispatcher._cache_misses[args] += 1
        told = {"dispatcher": self._dispatcher, "args": args, "return_type": None}
        with event.trigger_event("numba:compile", data=told):
            result = with_short_slice_errors(self._compiler.compile)(args, None)
        self._kept.save(args, result)
        return result


def link_environments(result: Any) -> None:
    """Give a compiled kernel the environments of all kernels that were merged into it."""
    for environment in result._find_referenced_environments():
        result.library.codegen.set_env(environment.env_name, environment)
