"""Messages about a wrong campaign: one line per problem, with its place, the value and what is allowed."""

import difflib
import json
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

from solver.case import parameters_of_a_case
from solver.drive import parameters_of_a_drive
from solver.outcome import SHOWN, InvalidInput, quoted
from study.manifest.parameters import axes, of_symbol, table_of

LONGEST_PATH = 200
"""The most characters of a path that a message shows."""

MOST_LINES = 100
"""Problems that a message lists: an axis may have a hundred thousand wrong values."""

ONE_LINE = "needs to be one line without control characters"


class ManifestError(Exception):
    """A campaign file is wrong. `lines` has one printable line for each of its problems."""

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = tuple(map(printable, lines))
        super().__init__(self.lines)

    def __str__(self) -> str:
        more = len(self.lines) - MOST_LINES
        return "\n".join([*self.lines[:MOST_LINES], *([f"and {more} problems more"] if more > 0 else [])])


def shown(value: object) -> str:
    """A value in the notation of TOML or nearly so, at most SHOWN characters."""
    try:
        text = repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
    except (ValueError, RecursionError):  # Python writes no number of more than 4300 digits, and nothing nested deeply
        return quoted(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def key_shown(key: str) -> str:
    """A key of a campaign file, at most SHOWN characters; in quotes where it is not a single word."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) and len(key) <= SHOWN else shown(key)


def printable(text: str) -> str:
    """A text on one line, with escapes for what a terminal obeys: control characters, changes of the direction of writing."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def path_shown(path: Path) -> str:
    """A path as one printable line of at most LONGEST_PATH characters."""
    text = printable(str(path))
    return text if len(text) <= LONGEST_PATH else text[: LONGEST_PATH - 3] + "..."


def one_line(text: str) -> bool:
    """Whether a text is without line breaks and other control characters: a terminal obeys them, and a dataset ends at a null."""
    return not any(unicodedata.category(letter) in ("Cc", "Zl", "Zp") for letter in text)


def need(make: Callable[..., object], *arguments: object) -> str:
    """Call `make`; return what is needed (`needs ...`) where it raises InvalidInput, an empty text where it does not."""
    try:
        make(*arguments)
    except InvalidInput as error:
        return "needs " + str(error).rpartition(": needs ")[2]
    return ""


def unknown(word: str, allowed: Collection[str]) -> str:
    """Advice on a word that is not allowed here: the table that takes it, what it is a symbol of or like, or all allowed ones."""
    return meant_by(word, allowed) or "unknown; needs one of " + ", ".join(allowed)


def meant_by(word: str, allowed: Collection[str]) -> str:
    """The same of a word that somebody may have meant; empty for any other text."""
    if table := table_of(word):
        return f"belongs in [{table}]" + (" or [axes]" if word in axes() else "")
    of_drives = parameters_of_a_drive()
    if word in of_drives:
        return "belongs in [[drives]] or [drive_axes]"
    meant = of_symbol(word, {**parameters_of_a_case(), **of_drives})
    if meant != word:
        return f"unknown; did you mean {meant}" + ("?" if meant in allowed else f", which {unknown(meant, allowed)}?")
    near = difflib.get_close_matches(word[:SHOWN], allowed, 1)
    return f"unknown; did you mean {near[0]}?" if near else ""
