"""What is wrong with a campaign, in words: one line per problem, saying where, the value and what is allowed."""

import difflib
import json
from collections.abc import Callable, Collection, Iterable

from solver.outcome import InvalidInput
from study.parameters import AXES, TABLES


class ManifestError(Exception):
    """All that is wrong with a campaign file: `lines`, one per problem."""

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = tuple(lines)
        super().__init__(self.lines)

    def __str__(self) -> str:
        return "\n".join(self.lines)


def shown(value: object) -> str:
    """A value much as its author wrote it, cut to fit a line."""
    text = repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def need(make: Callable[..., object], *arguments: object) -> str:
    """What `make` says is needed when it refuses its arguments; empty when it takes them."""
    try:
        make(*arguments)
    except InvalidInput as error:
        return "needs " + str(error).partition(": needs ")[2]
    return ""


def unknown(word: str, allowed: Collection[str]) -> str:
    """Advice on a word that is not allowed here: where it belongs, what it resembles, or what there is."""
    for table, words in TABLES.items():
        if word in words:
            return f"belongs in [{table}]" + (" or [axes]" if word in AXES else "")
    near = difflib.get_close_matches(word, allowed, 1)
    return f"unknown; did you mean {near[0]}?" if near else "unknown; needs one of " + ", ".join(allowed)
