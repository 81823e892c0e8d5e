"""Benchmarks one after the other, each in a process of its own, whose memory it is that is measured.

A process counts the memory of the one that started it, up to then, as its own.
"""

import importlib
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

from tests.benchmarks.table import Row

T = TypeVar("T")


def alone(work: Callable[..., T], *given: object) -> T:
    """What this returns in a process of its own."""
    with ProcessPoolExecutor(1, get_context("spawn")) as apart:
        return apart.submit(work, *given).result()


def rows_of(names: Iterable[str]) -> Iterator[Row]:
    """The rows of these benchmarks, files of this folder; says on standard error which one is at work."""
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as apart:
        for name in names:
            print(f"{name} …", file=sys.stderr, flush=True)
            yield from apart.submit(_rows, name).result()


def _rows(name: str) -> list[Row]:
    found: list[Row] = importlib.import_module(f"tests.benchmarks.{name}").rows()
    return found
