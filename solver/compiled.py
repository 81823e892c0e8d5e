"""Numerical kernels: declared as plain functions, compiled by numba when they are first called.

Loading numba takes longer than planning a campaign, so it is imported when the first kernel runs.
How a kernel is compiled, and kept on disk, is in nanoslip.solver.compiling.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cached_property, update_wrapper
from importlib import import_module
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., object])


class Kernel:
    """A function of which numba compiles one version for each combination of argument types."""

    def __init__(self, function: Callable[..., object], allocates: bool, entry: bool, options: dict[str, Any]) -> None:
        """options: of numba's `njit`."""
        update_wrapper(self, function)
        self.entry = entry
        # Numba inlines what has these two attributes of its own, and the option inline="always".
        self.py_func, self.allocates = function, allocates
        # A wrapper takes time to compile: one for Python only where it calls the kernel, one for C nowhere.
        self.targetoptions = {"no_cpython_wrapper": not entry, "no_cfunc_wrapper": True, **options}

    @cached_property
    def dispatcher(self) -> Any:
        """Numba's own object, which holds the compiled versions."""
        return _compiling().find_dispatcher(self.py_func, self.allocates, self.targetoptions)

    @property
    def _numba_type_(self) -> Any:
        """Type that numba requests of an unknown object: other kernels call this one as its dispatcher."""
        return self.dispatcher._numba_type_

    def __call__(self, *arguments: object) -> object:
        if not self.entry:
            raise TypeError(f"{self.py_func.__name__}: a kernel that Python calls is declared with entry=True")
        try:
            return self.dispatcher(*arguments)
        except SystemError as error:  # what Python makes of a signal's exception that was raised while a kernel ran
            raise error.__cause__ or error from None


def declare_kernel(*, allocates: bool = False, entry: bool = False, **options: Any) -> Callable[[Function], Function]:
    """Decorator: numba's `njit` without the interpreter's lock, with further `options`, and kept on disk.

    allocates: whether the kernel makes or returns arrays or lists. Only then are references to arrays counted, which
    takes longer than a slip; numba refuses to compile a kernel that makes arrays without.
    entry: whether Python, or a test, may call the kernel, which takes longer to compile then.
    """

    def declare(function: Function) -> Function:
        kernel: Any = Kernel(function, allocates, entry, options)
        return kernel  # type: ignore[no-any-return]

    return declare


def reporting_compilation(tell: Callable[[], object]) -> AbstractContextManager[None]:
    """Call `tell`, inside this context, when a kernel begins to be compiled; not for a kernel cached on disk."""
    listening: AbstractContextManager[None] = _compiling().listening(tell)
    return listening


def _compiling() -> Any:
    return import_module("nanoslip.solver.compiling")
