"""Functions that are compiled, and are linked into each other as they are.

Most compiled functions are called by others alone, into which they are linked. Numba
would give each machine code of its own, and two wrappers to call it from outside: a
third of the time that compiling takes. Here what compiled code calls is compiled as far
as it can be linked, and what Python calls as far as it runs.
"""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core import types
from numba.core.codegen import CPUCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

from mpisph.core.jit import ENTRY, EXACT

Equation = Callable[..., Any]
Function = TypeVar("Function", bound=Equation)


def jitted(**options: Any) -> Callable[[Equation], Equation]:
    """Return the decorator of a function that is compiled wherever it is called.

    Parameters
    ----------
    **options
        As of `numba.njit`, such as those of `core.jit`.
    """

    def decorate(function: Equation) -> Equation:
        if numba.config.DISABLE_JIT:
            return function
        compiled = _Jitted(function, targetoptions={"nopython": True, **options})
        compiled.enable_caching()
        return compiled

    return decorate


def jitable(function: Function, compiled: Equation | None = None) -> Function:
    """Return a function that is compiled where compiled code calls it, only there.

    Parameters
    ----------
    function : callable
        What Python calls.
    compiled : callable, optional
        What is compiled in its place; called in the same way.
    """
    if numba.config.DISABLE_JIT:
        return function
    return _Jitable(function, compiled or function)  # type: ignore[return-value]


class _Library(CPUCodeLibrary):  # type: ignore[misc]
    """Code that can be linked into that of a caller, and not be run."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _Compiler(Compiler):  # type: ignore[misc]
    """Numba's own, but for the machine code."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.flags.no_compile = True
        name = state.func_id.func_qualname
        state.library = _Library(state.targetctx.codegen(), name)
        return super().define_pipelines()


class _Linked(CPUDispatcher):  # type: ignore[misc]
    """Compiles a function for compiled code."""

    def __init__(
        self, function: Equation, locals: Any = None, targetoptions: Any = None
    ) -> None:  # as Numba calls it
        alone = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        options = {**(targetoptions or {}), **alone}
        super().__init__(function, locals or {}, options, pipeline_class=_Compiler)

    def add_overload(self, found: Any) -> None:
        # Numba knows it by its entry point, of which there is none.
        found = found._replace(entry_point=found.fndesc)
        self.targetctx.insert_user_function(found.fndesc, found.fndesc, [found.library])
        self.overloads[tuple(found.signature.args)] = found


class _Jitted(CPUDispatcher):  # type: ignore[misc]
    """Compiles a function for Python, and lets another compile it for compiled code."""

    def __init__(
        self, function: Equation, locals: Any = None, targetoptions: Any = None
    ) -> None:  # as Numba calls it
        options = {**(targetoptions or {}), "no_cfunc_wrapper": True}
        super().__init__(function, locals or {}, options)
        self._linked = _Linked(function, targetoptions=options)

    @property
    def is_compiling(self) -> Any:
        return super().is_compiling or self._linked.is_compiling

    def get_call_template(self, args: Any, kws: Any) -> Any:
        return self._linked.get_call_template(args, kws)

    def get_overload(self, signature: Any) -> Any:
        return self._linked.get_overload(signature)

    def add_overload(self, found: Any) -> None:
        # What is linked into it raises its errors by environments of its own.
        for environment in found._find_referenced_environments():
            found.library.codegen.set_env(environment.env_name, environment)
        super().add_overload(found)


class _Jitable:
    """A function for Python, and what is compiled for compiled code."""

    def __init__(self, function: Equation, compiled: Equation) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        options = {"nopython": True, **ENTRY}
        self._linked = _Linked(compiled, targetoptions=options)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._function(*args, **kwargs)

    @property
    def _numba_type_(self) -> Any:
        return types.Dispatcher(self._linked)


@jitted(**EXACT)
def copy_to(given: Any, room: Any) -> None:
    """Copy numbers into an array of as many.

    Assigned to a part of an array they would take 3 s to compile, for what is said
    where shapes differ.
    """
    for k in range(given.size):
        room[k] = given[k]
