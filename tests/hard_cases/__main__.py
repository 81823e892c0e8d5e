"""Endings of random scenes of each kind, counted and held to the laws: `python -m tests.hard_cases [SEED]`, or `make hard`.

It writes tests/hard_cases/endings.csv. A scene that breaks a law ends the program, with its text.
"""

import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from hypothesis import strategies as st

from tests.hard_cases.scenery import driven_scenes, scenes
from tests.hard_cases.test_scenes import drawn, tried
from tests.written_tables import show

KINDS: Final[Mapping[str, tuple[st.SearchStrategy[str], int]]] = {
    "every key, far beyond what is sensible": (scenes(), 600),
    "the same on 65 to 257 nodes": (scenes(grids=(65, 129, 257), events=20), 60),
    "sensible, driven": (driven_scenes(), 200),
}
"""Kind of scenes -> how they are drawn, and how many."""


def counted(seed: int) -> dict[str, Counter[str]]:
    """Kind of scenes -> how often each ending occurred."""
    with TemporaryDirectory() as folder:
        return {kind: tried(drawn(way, count, seed), seed, Path(folder)) for kind, (way, count) in KINDS.items()}


def rows(found: Mapping[str, Counter[str]]) -> list[tuple[object, ...]]:
    """A row for each ending, the most frequent first, and a column for each kind."""
    order = [ending for ending, _ in sum(found.values(), Counter[str]()).most_common()]
    return [("ending", *found), *((ending, *(each[ending] for each in found.values())) for ending in order)]


if __name__ == "__main__":
    show(rows(counted(int(sys.argv[1]) if len(sys.argv) > 1 else 1)), Path(__file__).with_name("endings.csv"))
