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
        line = f"line {self.part}" if isinstance(self.part, int) else ""
        inside = f"{self.part}.{key}" if self.part and key and not line else key or str(self.part)
        return ": ".join(filter(None, (self.file, line, inside if key or not line else "")))


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

    def __str__(self) -> str:
        missing = self.value is None
        given = not missing and self.value is not ABSENT
        where = self.place.of(self.key) + (f" = {quote_rounded(self.value)}" if given else "")
        parts = (where, "missing" if missing else "", self.remark, self.need and f"needs {self.need}")
        return escape(": ".join(filter(None, parts)))


class ManifestError(NanoslipError):
    """A campaign is wrong: all of its problems."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    @classmethod
    def of(cls, key: str, value: object = ABSENT, need: str = "", remark: str = "") -> "ManifestError":
        """An error of a single problem that is in no file."""
        return cls([Problem(Place(), key, value, need, remark)])

    @classmethod
    def in_file(cls, path: Path, need: str = "", remark: str = "", line: int | None = None) -> "ManifestError":
        """An error of a single problem with a whole file, or with a line of it."""
        place = Place(path_shown(path), "" if line is None else line)
        return cls([Problem(place, "", ABSENT, need, remark)])

    def drop_places(self) -> "ManifestError":
        """Error without the places of its problems, for keys that were given without a file and without tables."""
        return ManifestError(replace(each, place=Place()) for each in self.problems)

    def __str__(self) -> str:
        more = len(self.problems) - MOST_LINES
        lines = list(map(str, self.problems[:MOST_LINES]))
        return "\n".join([*lines, *([f"and {more} problems more"] if more > 0 else [])])


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
    return quote_toml(float(f"{value:.10g}") if isinstance(value, float) else value)


def key_shown(key: str) -> str:
    """A key of a campaign file, at most SHOWN characters; in quotes where it is not a single word."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) and len(key) <= SHOWN else quote_toml(key)


def escape(text: str) -> str:
    """A text on one line, with control characters and changes of writing direction escaped."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def path_shown(path: Path) -> str:
    """A path as one printable line of at most LONGEST_PATH characters."""
    text = escape(str(path))
    return text if len(text) <= LONGEST_PATH else text[: LONGEST_PATH - 3] + "..."


def unknown(word: str, allowed: Collection[str]) -> str:
    """Advice on a word that is not allowed here: its table, the key of this symbol, a similar key, or all allowed keys."""
    return suggestion_remark(word, allowed) or "unknown; needs one of " + ", ".join(allowed)


def suggestion_remark(word: str, allowed: Collection[str]) -> str:
    """Remark on a misplaced or misspelt word, or one of physics beyond the model; empty for any other text."""
    if place := _home(word):
        return "; or did you mean ".join(filter(None, (place, key_meant(word))))
    symbol = word_for_symbol(word, {**parameters_of_a_case(), **parameters_of_a_drive()})
    if symbol == word and (how := otherwise(word)):
        return how
    meant = symbol
    if symbol == word:
        meant = key_meant(word)
    if not meant and not missing_physics(word):
        meant = "".join(difflib.get_close_matches(word[:SHOWN], allowed, 1))
    if not meant:
        return missing_physics(word)
    home = "" if meant in allowed else _home(meant)
    return f"unknown; did you mean {meant}" + (f", which {home}?" if home else "?")


def _home(word: str) -> str:
    """Table in which a known word belongs, as a remark; empty for any other."""
    if table := table_taking(word):
        return f"belongs in [{table}]" + (" or [axes]" if word in axes() else "")
    table = next((table for table, keys in OTHER_TABLES.items() if word in keys), "")
    place = "[[drives]] or [drive_axes]" if table == "drives" else f"[{table}]"
    return f"belongs in {place}" if table else ""
