"""One's own numbers: functions of a Python file beside a campaign. Here their text is read and parsed, never executed.

The meaning of a number, and whether it belongs to a record or to a drive, follow from the text. Only a process that computes
executes the file (nanoslip.study.tasks.functions).
"""

import ast
import difflib
import hashlib
import math
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from nanoslip.solver.outcome import LONGEST_MESSAGE, InvalidInput, printable
from nanoslip.solver.parameter import require
from nanoslip.study.measured.units import factor

KEY: Final = "observables"
"""Key of [outputs] that names them."""
PARAMETERS: Final = "one parameter, the friction record, or a second one, the motion of its drive"
REFERENCE: Final = 'a list, as ["mine:largest_drop"]: that function of mine.py'


@dataclass(frozen=True, slots=True)
class Observable:
    """One's own number of a friction record or of a drive over it."""

    name: str
    """Name of the variable in a dataset."""
    function_name: str
    module: str
    """Name of its file without the ending, or of a module of Python."""
    meaning: str
    """First line of its docstring, or its name."""
    comment: str
    """All further lines."""
    unit: str
    """Unit in brackets behind that first line, as `Largest drop [mN]`; empty of pure numbers."""
    driven: bool
    """True if it is a number of a drive."""
    text: str = field(repr=False)
    """Source by which results are known: the text of the whole file, or of the function if there is no file."""
    file: str
    """Path of the source, which messages name."""
    function: Callable[..., Any] | None = field(default=None, compare=False)
    """The function where a caller gave it; None if the text is to be executed."""

    @property
    def sha256(self) -> str:
        """Hash of the source."""
        return hashlib.sha256(self.text.encode("utf-8", "surrogatepass")).hexdigest()

    @property
    def identity(self) -> tuple[str, str, str]:
        """All that decides its values."""
        return self.name, self.function_name, self.sha256

    @property
    def reference(self) -> str:
        """Module and function."""
        return f"{self.module}:{self.function_name}"


class Explained(NamedTuple):
    """Docstring of a function as a meaning and a comment, one line each, and the unit."""

    meaning: str
    comment: str
    unit: str


_UNIT: Final = re.compile(r"(.*\S)\s*\[([^\[\]]{1,40})\]")
"""A meaning and a unit in brackets, as titles of measured columns have it."""


def explain_docstring(docstring: str | None, name: str) -> Explained:
    """The first line of a docstring, and all further ones; the name in words without a docstring.

    Brackets at the end of the first line are the unit, if pint knows it; else they belong to the meaning.
    """
    first, _, rest = (docstring or "").strip().partition("\n")
    # Each becomes an attribute of a dataset, of one line, without characters that a terminal would obey.
    lines = [printable(part, LONGEST_MESSAGE) for part in (first.rstrip(" ."), rest)]
    meaning, comment = (" ".join(line.split()) for line in lines)
    with_unit = _UNIT.fullmatch(meaning)
    if with_unit and math.isfinite(factor(with_unit[2], with_unit[2])):
        return Explained(with_unit[1].rstrip(" ."), comment, with_unit[2])
    return Explained(meaning or name.replace("_", " "), comment, "")


def is_driven(required: int, refused: bool = False) -> bool | None:
    """True for a function of a record and a motion, False for one of a record; None for any other.

    required: positional parameters without default. refused: whether it needs others, too.
    """
    if refused or required not in (1, 2):
        return None
    return required == 2


class Reference(NamedTuple):
    """A function of a file beside a campaign."""

    module: str
    name: str

    @property
    def file(self) -> str:
        """Name of the file."""
        return f"{self.module}.py"


def parse_reference(value: Any) -> Reference:
    """The reference that a text `module:function` is. Raises InvalidInput."""
    text = value if isinstance(value, str) else ""
    module, _, name = text.partition(":")
    require(KEY, value, _is_name(module) and _is_name(name), REFERENCE)
    return Reference(module, name)


def require_references(values: Any) -> tuple[str, ...]:
    """The references of a list. Raises InvalidInput unless each is `module:function`, each function's name once."""
    require(KEY, values, isinstance(values, list | tuple), REFERENCE)
    names = set[str]()
    # The function's name alone is the variable of the dataset: of two files they must not collide.
    for reference in values:
        name = parse_reference(reference).name
        require(KEY, reference, name not in names, f"another name: {name} is there twice")
        names.add(name)
    return tuple(values)


def source_files(references: Any) -> list[str]:
    """Files that a list of references names, each once; none if it is no such list."""
    try:
        require_references(references)
    except InvalidInput:
        return []
    files = [parse_reference(reference).file for reference in references]
    return list(dict.fromkeys(files))


def _is_name(word: str) -> bool:
    """True for a name of Python that every file system and terminal shows alike."""
    return word.isidentifier() and word.isascii()


# The text of a file, parsed.


def _parse(file: Path, text: str) -> ast.Module:
    try:
        return ast.parse(text)
    except SyntaxError as error:
        need = f"Python in {file.name}: line {error.lineno}: {error.msg}"
    # A text with null bytes, or nested too deeply for the parser: any file may be named, also none of Python.
    except (ValueError, RecursionError, MemoryError) as error:
        need = f"Python in {file.name}: {type(error).__name__}"
    raise InvalidInput(KEY, file.name, need)


def find_function(name: str, file: Path, text: str) -> Observable:
    """The function of this name in a source. Raises InvalidInput."""
    statements = _parse(file, text).body
    functions = {statement.name: statement for statement in statements if isinstance(statement, ast.FunctionDef)}
    if name not in functions:
        raise InvalidInput(KEY, name, _missing_need(name, file.name, functions))
    function = functions[name]
    parameters = function.args
    positional = len(parameters.posonlyargs) + len(parameters.args)
    # Python lists a keyword without default as None: nobody would give it a value.
    required = positional - len(parameters.defaults)
    driven = is_driven(required, refused=None in parameters.kw_defaults)
    if driven is None:
        raise InvalidInput(KEY, name, f"{PARAMETERS}: def {name}(record) or def {name}(record, motion)")
    meaning, comment, unit = explain_docstring(ast.get_docstring(function), name)
    return Observable(name, name, file.stem, meaning, comment, unit, driven, text, str(file))


def _missing_need(name: str, file: str, functions: Collection[str]) -> str:
    similar = difflib.get_close_matches(name, functions, 1)
    names = ", ".join(functions) or "none"
    advice = f"did you mean {similar[0]}?" if similar else f"it has {names}"
    return f"a function def {name}(record) in {file}, not inside of anything else; {advice}"


# What a number needs of its campaign.


def stage_need(observable: Observable, stages: Collection[str]) -> str:
    """The stage that a number needs and its campaign lacks; empty if the campaign has all."""
    if "slip" not in stages:
        return 'stage "slip": without it there is no friction record'
    if observable.driven and "dynamics" not in stages:
        return 'stage "dynamics", which a [[drives]] table brings: its second parameter is the motion of a drive'
    return ""
