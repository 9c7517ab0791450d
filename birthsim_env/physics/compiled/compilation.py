"""Kernels: loops over lanes, run by prebuilt machine code where their sources are those that it was built from, else by Numba.

Kernels run over lanes (environments). They are written so that LLVM vectorises the innermost loop: quantities are rows of
scratch arrays whose shape is a compile-time constant, helpers are always inlined, conditions are max, min or a ternary, and
only + - * / sqrt occur inside. Without ``fastmath`` every operation is IEEE-exact, so a lane computes the same bits
whether it runs in a vector register or alone. Numba is imported when a kernel is first compiled, and not before.
"""

import functools
import pickle
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.plain import DEBUG, plain

F = TypeVar("F", bound=Callable[..., Any])


class Kernel:
    """A kernel, or a helper, which is a kernel when it is called from Python."""

    def __init__(self, function: Callable[..., Any], inlined: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.py_func, self.inlined = function, inlined
        self._ready: dict[Any, Callable[..., Any]] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if named:
            return self.numba(*arguments, **named)
        kinds = tuple(map(prebuilt.kind_of, arguments))
        ready = self._ready.get(kinds)
        if ready is None:
            ready = self._ready[kinds] = prebuilt.function(self, kinds) or self.numba
        return ready(*arguments)

    def __reduce__(self) -> str | tuple[Any, ...]:
        """By name; by value what another process would not find by that: a script's own, and what stands in a function."""
        name, module = self.py_func.__qualname__, self.py_func.__module__
        if module != "__main__" and getattr(sys.modules.get(module), name, None) is self:
            return name
        from birthsim_env.physics.compiled import with_numba  # late: prebuilt code needs none of it

        return _loaded, (with_numba.dumped(self.py_func), self.inlined)

    @functools.cached_property
    def numba(self) -> Any:
        """What Numba makes of it."""
        from birthsim_env.physics.compiled import with_numba  # late: as above

        return with_numba.kernel(self.py_func)

    @functools.cached_property
    def by_numbers(self) -> Callable[..., int]:
        """What runs it for whole numbers."""
        found: Callable[..., int] = prebuilt.of_numbers(self, self.py_func.__code__.co_argcount) or self.numba
        return found

    @functools.cached_property
    def _within(self) -> Any:
        from birthsim_env.physics.compiled import with_numba  # late: as above

        return with_numba.helper(self.py_func) if self.inlined else self.numba

    @property
    def _numba_type_(self) -> Any:
        """What other kernels see of it."""
        return self._within._numba_type_


def _loaded(content: bytes, inlined: bool) -> Kernel:
    return Kernel(pickle.loads(content), inlined)


def kernel(function: F) -> F:
    """Compile a loop over lanes; releases the interpreter lock.

    With ``BIRTHSIM_DEBUG=1`` it stays plain Python, as a ``helper`` does."""
    return plain(function) if DEBUG else Kernel(function)  # type: ignore[return-value]


def helper(function: F) -> F:
    """Compile a function that is always inlined into the kernels that call it; called from Python it is a kernel."""
    return plain(function) if DEBUG else Kernel(function, inlined=True)  # type: ignore[return-value]


def of_numbers(kernel: Callable[..., int]) -> Callable[..., int]:
    """What runs a kernel of whole numbers that returns one, without a look at its arguments: for whoever calls it often.

    An array is passed by its address, with what else is fixed in an array of whole numbers that is kept along."""
    return kernel.by_numbers if isinstance(kernel, Kernel) else kernel


class Late:
    """What kernels call of ``module``, which needs Numba: it is imported when Numba first asks."""

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name = module, name

    @property
    def _numba_type_(self) -> Any:
        from birthsim_env.physics.compiled import with_numba  # late: as above

        return with_numba.type_of(getattr(import_module(self._module), self._name))


def over(function: Callable[..., Any], *arguments: Any) -> None:
    """Run a kernel over arrays, or what has the rows of arrays, the last of which it writes; over symbols it is traced."""
    written = getattr(arguments[-1], "rows", arguments[-1])
    if hasattr(written, "trace_kernel"):
        written.trace_kernel(function, *arguments)
    else:
        function(*arguments)
