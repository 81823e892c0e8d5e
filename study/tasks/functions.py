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
            try:
                value = math.nan if arguments is None else _finite_or_nan(load(number)(*arguments))
            except MemoryError:
                raise
            except (Exception, SystemExit) as error:
                failures.append(error)
                value = math.nan
            values.append(value)
        scalars[number.name] = values
        if failures:
            share = "" if len(failures) == len(members) else f" ({len(failures)} of {len(members)} members)"
            message = f"{number.name}: {describe_error(failures[0], number)}{share}"
            outcome = outcome.adding(Outcome(Ending.COMPLETED, message))
    return Evaluated(scalars, outcome)


def _finite_or_nan(given: Any) -> float:
    """A function's value as a number; NaN is how it says that there is none. Raises ValueError for anything else."""
    value = given.item() if getattr(given, "ndim", None) == 0 else given
    if not isinstance(value, numbers.Real):
        raise ValueError(f"needs to be a number, and is a {type(value).__name__}")
    if math.isinf(value):
        raise ValueError("needs to be a finite number, and is infinite")
    return float(value)


def describe_error(error: BaseException, number: Observable) -> str:
    """Kind and text of an error, and the line of the user's file where it arose; the same in every process."""
    said = _ADDRESS.sub("0x…", str(error))
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == number.file]
    place = f" ({Path(number.file).name}, line {lines[-1]})" if lines else ""
    return f"{type(error).__name__}{': ' if said else ''}{said}{place}"


_ADDRESS: Final = re.compile(r"\b0x[0-9a-fA-F]+")
"""Address of an object in the text of an error, which differs from process to process."""


@lru_cache
def load(number: Observable) -> Callable[..., Any]:
    """The function of a number: that of a caller, or what its text defines, which is executed here. Raises what that raises."""
    if number.function is not None:
        return number.function
    function: Callable[..., Any] = getattr(
        _execute(number.module, number.file, number.text, number.sha256), number.name
    )
    return function


@lru_cache
def _execute(name: str, file: str, text: str, sha256: str) -> ModuleType:
    """The module that a text is, under a name that no other has: a changed text is another module."""
    module = ModuleType(f"{name}_{sha256}")
    module.__file__ = file
    sys.modules[module.__name__] = module  # where dataclasses look for it
    try:
        exec(compile(text, file, "exec", dont_inherit=True), module.__dict__)
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
    """Load a number; returns what it needs if it does not load."""
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
        if any(path.exists() for path in (file.with_name(f"{module}.py"), file.with_name(module) / "__init__.py")):
            return f"all in {file.name}: it imports {module}, a file beside it, whose changes nobody would notice"
    return ""


def _imported_modules(text: str) -> Iterator[str]:
    """Packages and modules that a source imports, by the first part of their names."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (each.name.partition(".")[0] for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or node.names[0].name).partition(".")[0]


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
    require(key, function, isinstance(name, str) and name.isidentifier() and name.isascii(), "a name, as largest_drop")
    require(key, function, inspect.isfunction(function), "a function, by def or lambda")
    require(key, function, not apart or _is_importable(function), APART.format(name=name))
    text, driven = _source(function), _is_driven(function)
    require(key, function, bool(text), SOURCE)
    if driven is None:
        raise InvalidInput(key, function, PARAMETERS)
    docstring = explain_docstring(function.__doc__, name)
    module, own_name = function.__module__, function.__qualname__
    return Observable(name, own_name, module, *docstring, driven, text, function.__code__.co_filename, function)


def _is_importable(function: Callable[..., Any]) -> bool:
    """True if another process finds the function by its module and name."""
    module = sys.modules.get(function.__module__)
    return function.__module__ != "__main__" and getattr(module, function.__qualname__, None) is function


def _source(function: Any) -> str:
    """Source of a function's file, or of the function where it is in none, and values that it brings; empty if unknown."""
    brought = repr((inspect.getclosurevars(function).nonlocals, function.__defaults__, function.__kwdefaults__))
    module: Any = sys.modules.get(function.__module__)
    for place in (module, function):
        with suppress(OSError, TypeError):
            return inspect.getsource(place) + brought
    return ""


def _is_driven(function: Callable[..., Any]) -> bool | None:
    """True or False as `is_driven`, by a function's signature."""
    given = inspect.signature(function).parameters.values()
    needed = [each for each in given if each.default is each.empty]
    positional = [each for each in needed if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)]
    return is_driven(len(positional), refused=any(each.kind is each.KEYWORD_ONLY for each in needed))
