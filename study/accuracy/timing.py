"""Processor time, and the machine that it was measured on."""

import platform
import time
from collections.abc import Callable
from typing import TypeVar

from nanoslip.study import provenance
from nanoslip.study.machine import model

T = TypeVar("T")


def timed(run: Callable[[], T], repeats: int = 1) -> tuple[T, float]:
    """What `run` returns and the shortest of its processor times, in s."""
    shortest = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        shortest = min(shortest, time.process_time() - start)
    return result, shortest


def machine() -> dict[str, str]:
    """The processor and the software that times are measured with."""
    return {"processor": model(), "system": platform.system(), **provenance.attributes()}
