"""Problems of a campaign as values: place, key, value, and requirement. They become sentences in `str` alone."""

import difflib
import itertools
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.solver.drive import parameters_of_a_drive
from nanoslip.solver.outcome import ABSENT, SHOWN, NanoslipError
from nanoslip.study.manifest.parameters import OTHER_TABLES, axes, table_taking, word_for_symbol
from nanoslip.study.manifest.vocabulary import key_meant, missing_physics, otherwise
from nanoslip.study.toml_text import quote_toml

LONGEST_PATH = 200
"""The most characters of a path that a message shows."""

MOST_LINES = 100
"""Problems that a message lists: an axis may have a hundred thousand wrong values."""


class Place(NamedTuple):
    """Place in an input: a file, and a table or a line of it."""

    file: str = ""
    part: str | int = ""

    def of(self, key: str) -> str:
        """This place and a key there, as messages show it."""
        # A line of a table of cases has a column as key, if any; a table of the campaign file leads its key with a dot.
        if isinstance(self.part, int):
            parts: tuple[str, ...] = (self.file, f"line {self.part}", key)
        elif self.part and key:
            parts = (self.file, f"{self.part}.{key}")
        else:
            parts = (self.file, key or self.part)
        return ": ".join(filter(None, parts))


@dataclass(frozen=True, slots=True)
class Problem:
    """Problem in a campaign: a key, its value, and the need or remark."""

    place: Place
    key: str
    value: object = ABSENT
    need: str = ""
    """Allowed values."""
    remark: str = ""
    """Problem, if the value alone does not show it: the key is unknown, or belongs elsewhere."""

    @classmethod
    def of(cls, key: str, value: object = ABSENT, need: str = "", remark: str = "", table: str = "") -> "Problem":
        """A problem with a key of a campaign's table, or of its top, without the name of the file."""
        return cls(Place(part=table), key, value, need, remark)

    def __str__(self) -> str:
        # None is a key that has to be there; ABSENT is a problem without a value, as that of a whole file.
        parts = [self.place.of(self.key)]
        if self.value is None:
            parts.append("missing")
        elif self.value is not ABSENT:
            parts[0] += f" = {quote_rounded(self.value)}"
        parts.append(self.remark)
        if self.need:
            parts.append(f"needs {self.need}")
        return escape(": ".join(filter(None, parts)))


Problems = list[Problem]


class ManifestError(NanoslipError):
    """A campaign is wrong: all of its problems."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    @classmethod
    def of(cls, key: str, value: object = ABSENT, need: str = "", remark: str = "") -> "ManifestError":
        """An error of a single problem that is in no file."""
        return cls([Problem.of(key, value, need, remark)])

    @classmethod
    def in_file(cls, path: Path, need: str = "", remark: str = "", line: int | None = None) -> "ManifestError":
        """An error of a single problem with a whole file, or with a line of it."""
        place = Place(path_shown(path), "" if line is None else line)
        return cls([Problem(place, "", ABSENT, need, remark)])

    def name_file(self, path: Path) -> "ManifestError":
        """Error whose problems are in this file, unless they are in another one."""
        problems = []
        for problem in self.problems:
            place = problem.place if problem.place.file else problem.place._replace(file=str(path))
            problems.append(replace(problem, place=place))
        return ManifestError(problems)

    def drop_places(self) -> "ManifestError":
        """Error without the places of its problems, for keys that were given without a file and without tables."""
        return ManifestError(replace(problem, place=Place()) for problem in self.problems)

    def __str__(self) -> str:
        lines = list(map(str, self.problems[:MOST_LINES]))
        more = len(self.problems) - MOST_LINES
        if more > 0:
            lines.append(f"and {more} problems more")
        return "\n".join(lines)


MOST_REPEATED = 8
"""Repeated values that a message lists."""


def repeated_remark(repeated: Collection[object]) -> str:
    """Remark on these values, which appear more than once: at most MOST_REPEATED of them."""
    shown = list(map(quote_rounded, itertools.islice(repeated, MOST_REPEATED)))
    more = len(repeated) - len(shown)
    if more:
        shown.append(f"and {more} values more")
    return f"repeats {', '.join(shown)}"


def quote_rounded(value: object) -> str:
    """A value in the notation of TOML, numbers to ten digits: a division by a unit leaves 1.4899999999999998."""
    rounded = float(f"{value:.10g}") if isinstance(value, float) else value
    return quote_toml(rounded)


def key_shown(key: str) -> str:
    """A key of a campaign file, at most SHOWN characters; in quotes where it is not a single word."""
    # What TOML calls a bare key; any other may have line ends or thousands of characters, which `quote_toml` shortens.
    is_bare = re.fullmatch(r"[A-Za-z0-9_-]+", key) is not None
    return key if is_bare and len(key) <= SHOWN else quote_toml(key)


def escape(text: str) -> str:
    """A text on one line, with control characters and changes of writing direction escaped."""
    # A terminal obeys control characters: the name of a file must not be able to clear the screen.
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def path_shown(path: Path) -> str:
    """A path as one printable line of at most LONGEST_PATH characters."""
    text = escape(str(path))
    if len(text) <= LONGEST_PATH:
        return text
    return text[: LONGEST_PATH - 3] + "..."


def unknown(word: str, allowed: Collection[str]) -> str:
    """Advice on a word that is not allowed here: its table, the key of this symbol, a similar key, or all allowed keys."""
    return suggestion_remark(word, allowed) or "unknown; needs one of " + ", ".join(allowed)


def suggestion_remark(word: str, allowed: Collection[str]) -> str:
    """Remark on a misplaced or misspelt word, or one of physics beyond the model; empty for any other text."""
    # Certain answers come before guesses: the table of a key, a symbol, another name; similar letters are tried last, as
    # `wear` would else become a key that is spelt like it.
    place = _home(word)
    if place:
        return "; or did you mean ".join(filter(None, (place, key_meant(word))))
    meant = word_for_symbol(word, {**parameters_of_a_case(), **parameters_of_a_drive()})
    if meant == word:
        how = otherwise(word)
        if how:
            return how
        meant = key_meant(word)
    if not meant and not missing_physics(word):
        meant = "".join(difflib.get_close_matches(word[:SHOWN], allowed, 1))
    if not meant:
        return missing_physics(word)
    home = "" if meant in allowed else _home(meant)
    question = f", which {home}?" if home else "?"
    return f"unknown; did you mean {meant}{question}"


def _home(word: str) -> str:
    """Table in which a known word belongs, as a remark; empty for any other."""
    table = table_taking(word)
    if table:
        or_axes = " or [axes]" if word in axes() else ""
        return f"belongs in [{table}]{or_axes}"
    for table, keys in OTHER_TABLES.items():
        if word in keys:
            place = "[[drives]] or [drive_axes]" if table == "drives" else f"[{table}]"
            return f"belongs in {place}"
    return ""
