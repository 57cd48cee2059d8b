"""Numba's dispatchers of kernels, each made when its kernel is first used.

A process declares hundreds of kernels when it imports this package, and uses a few of them. A
dispatcher takes numba a tenth of a millisecond, and consists of some fifty objects that garbage
collection looks through: made at once, all of them were a quarter of the time to a first answer.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from numba.core.registry import CPUDispatcher

from scene_graph_ros.geometry.compiled.signal_shield import shielded

__all__ = ["LazyDispatcher"]

_lock = threading.RLock()
"""Held while a dispatcher is made: other threads that use it wait for the whole one."""


class LazyDispatcher(CPUDispatcher):
    """A kernel's dispatcher before its first use, which makes it one of numba's own.

    All is a use but to ask for its class, ``py_func`` or text. The object stays, so whoever holds
    it has the dispatcher. Its class changes, so a later call takes no longer than any of numba's.
    No signal interrupts that, since numba can't go on with half a dispatcher.
    """

    def __init__(self, function: Callable[..., Any], initialize: Callable[[Any], None]) -> None:
        """Declare a function's kernel; its first use calls ``initialize`` with the dispatcher."""
        own = object.__getattribute__(self, "__dict__")
        own.update(py_func=function, _initialize=initialize)

    def __getattribute__(self, name: str) -> Any:
        """Return an attribute of the dispatcher."""
        if name not in ("py_func", "__class__", "__dict__"):
            _make(self)
        return object.__getattribute__(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute of the dispatcher."""
        _make(self)
        object.__setattr__(self, name, value)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel."""
        _make(self)
        return self(*arguments, **named)

    def __repr__(self) -> str:
        """Return the text of the dispatcher to be, which is part of the name of its type."""
        return f"{CPUDispatcher.__name__}({self.py_func})"


@shielded
def _make(dispatcher: Any) -> None:
    """Make a dispatcher of a declared kernel, unless it is one or this thread is making it."""
    own = object.__getattribute__(dispatcher, "__dict__")
    with _lock:
        if type(dispatcher) is not LazyDispatcher or "_is_being_made" in own:
            return
        try:
            own["_is_being_made"] = True
            own["_initialize"](dispatcher)
            object.__setattr__(dispatcher, "__class__", CPUDispatcher)
        finally:
            own.pop("_is_being_made", None)
        del own["_initialize"]
