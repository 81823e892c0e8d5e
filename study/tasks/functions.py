"""One's own numbers: functions are loaded and evaluated here, in processes that compute. An exception costs its number alone."""

import ast
import inspect
import math
import numbers
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

from nanoslip.solver.outcome import COMPLETED, Ending, InvalidInput, Outcome
from nanoslip.solver.parameter import require
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.observables import KEY, PARAMETERS, Observable, explain_docstring, is_driven
from nanoslip.study.manifest.problems import ManifestError, Place, Problem

Arguments = tuple[Any, ...]
"""The record of a member, or this and the motion over it."""


class Evaluated(NamedTuple):
    """One's own numbers of all members."""

    scalars: dict[str, list[float]]
    """Number by number, the values of the members; NaN where one has none."""
    outcome: Outcome
    """Completed, with a message on the numbers that some members lack."""


def evaluate(observables: Sequence[Observable], members: Sequence[Arguments | None]) -> Evaluated:
    """Evaluate one's own numbers for all members. None: a member without record or motion, which has no number.

    Raises MemoryError.
    """
    scalars: dict[str, list[float]] = {}
    outcome = COMPLETED
    for number in observables:
        values, failures = [], []
        for arguments in members:
            value = math.nan
            try:
                if arguments is not None:
                    function = load(number)
                    value = _finite_or_nan(function(*arguments))
            # Out of memory the task is computed again alone, with all of its numbers.
            except MemoryError:
                raise
            # A user's function may raise anything, or end the program by sys.exit: it costs this number alone.
            except (Exception, SystemExit) as error:
                failures.append(error)
            values.append(value)
        scalars[number.name] = values
        if failures:
            share = "" if len(failures) == len(members) else f" ({len(failures)} of {len(members)} members)"
            message = f"{number.name}: {describe_error(failures[0], number)}{share}"
            outcome = outcome.adding(Outcome(Ending.COMPLETED, message))
    return Evaluated(scalars, outcome)


def _finite_or_nan(answer: Any) -> float:
    """A function's value as a number; NaN is how it says that there is none. Raises ValueError for anything else."""
    # numpy returns arrays without a dimension, and numbers of its own that are no `Real`.
    value = answer.item() if getattr(answer, "ndim", None) == 0 else answer
    if not isinstance(value, numbers.Real):
        raise ValueError(f"needs to be a number, and is a {type(value).__name__}")
    if math.isinf(value):
        raise ValueError("needs to be a finite number, and is infinite")
    return float(value)


def describe_error(error: BaseException, number: Observable) -> str:
    """Kind and text of an error, and the line of the user's file where it arose; the same in every process."""
    kind = type(error).__name__
    text = _ADDRESS.sub("0x…", str(error))
    frames = traceback.extract_tb(error.__traceback__)
    # The innermost line of the user's file: frames below it are in numpy, those above it in this program.
    lines = [frame.lineno for frame in frames if frame.filename == number.file]
    place = f" ({Path(number.file).name}, line {lines[-1]})" if lines else ""
    return f"{kind}: {text}{place}" if text else f"{kind}{place}"


_ADDRESS: Final = re.compile(r"\b0x[0-9a-fA-F]+")
"""Address of an object in the text of an error, which differs from process to process."""


@lru_cache
def load(number: Observable) -> Callable[..., Any]:
    """The function of a number: that of a caller, or what its text defines, which is executed here. Raises what that raises."""
    if number.function is not None:
        return number.function
    module = _execute(number.module, number.file, number.text, number.sha256)
    function: Callable[..., Any] = getattr(module, number.name)
    return function


@lru_cache
def _execute(name: str, file: str, text: str, sha256: str) -> ModuleType:
    """The module that a text is, under a name that no other has: a changed text is another module."""
    module = ModuleType(f"{name}_{sha256}")
    module.__file__ = file
    # The imports from __future__ of this file are not the user's.
    code = compile(text, file, "exec", dont_inherit=True)
    # Dataclasses look up the module of a class there while its body runs.
    sys.modules[module.__name__] = module
    try:
        exec(code, module.__dict__)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    return module


def load_all(manifest: Manifest) -> None:
    """Load the functions of a campaign, before it is computed. Raises ManifestError, once for each file that does not load."""
    problems: dict[str, Problem] = {}
    for number in manifest.observables:
        need = _load_need(number)
        if need:
            place = Place(str(manifest.path), "outputs")
            problems.setdefault(need, Problem(place, KEY, number.reference, need))
    if problems:
        raise ManifestError(problems.values())


def _load_need(number: Observable) -> str:
    """Load a number; returns the requirement that it misses if it does not load."""
    # A function of Python brings what it needs; of a file nothing but its text decides the key of a result.
    need = "" if number.function else _one_file_need(Path(number.file), number.text)
    if need:
        return need
    try:
        load(number)
    except (Exception, SystemExit) as error:
        return f"a file that loads: {describe_error(error, number)}"
    return ""


def _one_file_need(file: Path, text: str) -> str:
    """Requirement on a source that imports a file beside it; empty for any other."""
    for module in _imported_modules(text):
        as_file, as_package = file.with_name(f"{module}.py"), file.with_name(module) / "__init__.py"
        if as_file.exists() or as_package.exists():
            return f"all in {file.name}: it imports {module}, a file beside it, whose changes nobody would notice"
    return ""


def _imported_modules(text: str) -> Iterator[str]:
    """Packages and modules that a source imports, by the first part of their names."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        # `from . import other` has no module, but a name.
        elif isinstance(node, ast.ImportFrom):
            name = node.module or node.names[0].name
            yield name.partition(".")[0]


# Functions that a caller of Python gives.

APART: Final = (
    "a function of a file: write it into mine.py, then from mine import {name}; other processes import it from there"
)
SOURCE: Final = "a function with a source, by which its results are known: write it into a file or a cell of a notebook"


def read_functions(functions: Mapping[str, Callable[..., Any]], apart: bool) -> tuple[Observable, ...]:
    """Numbers by the names of their variables -> functions. apart: whether other processes call them. Raises InvalidInput."""
    return tuple(_read_function(name, function, apart) for name, function in functions.items())


def _read_function(name: str, function: Callable[..., Any], apart: bool) -> Observable:
    key = f"{KEY}[{name!r}]"
    is_name = isinstance(name, str) and name.isidentifier() and name.isascii()
    require(key, function, is_name, "a name, as largest_drop")
    require(key, function, inspect.isfunction(function), "a function, by def or lambda")
    # Other processes get a function by its module and name: one of a notebook or an interpreter is in this process alone.
    is_found = not apart or _is_importable(function)
    require(key, function, is_found, APART.format(name=name))
    text, driven = _source(function), _is_driven(function)
    require(key, function, bool(text), SOURCE)
    if driven is None:
        raise InvalidInput(key, function, PARAMETERS)
    meaning, comment, unit = explain_docstring(function.__doc__, name)
    module, own_name = function.__module__, function.__qualname__
    file = function.__code__.co_filename
    return Observable(name, own_name, module, meaning, comment, unit, driven, text, file, function)


def _is_importable(function: Callable[..., Any]) -> bool:
    """True if another process finds the function by its module and name."""
    module = sys.modules.get(function.__module__)
    return function.__module__ != "__main__" and getattr(module, function.__qualname__, None) is function


def _source(function: Any) -> str:
    """Source of a function's file, or of the function where it is in none, and values that it brings; empty if unknown."""
    # The same text with another value in its closure or a default is another function, with other results.
    enclosed = inspect.getclosurevars(function).nonlocals
    values = repr((enclosed, function.__defaults__, function.__kwdefaults__))
    module: Any = sys.modules.get(function.__module__)
    # The whole file first, as a function may call others of it; in a notebook each cell is known by itself.
    for place in (module, function):
        with suppress(OSError, TypeError):
            return inspect.getsource(place) + values
    return ""


def _is_driven(function: Callable[..., Any]) -> bool | None:
    """True or False as `is_driven`, by a function's signature."""
    parameters = inspect.signature(function).parameters.values()
    kinds = [parameter.kind for parameter in parameters if parameter.default is parameter.empty]
    both_ways = {inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD}
    positional = [kind for kind in kinds if kind in both_ways]
    return is_driven(len(positional), refused=inspect.Parameter.KEYWORD_ONLY in kinds)
