"""Processor time, and the machine that spent it."""

import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from study import provenance

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
    return {"processor": _processor(), "system": platform.system(), **provenance.attributes()}


def _processor() -> str:
    facts = Path("/proc/cpuinfo")
    lines = facts.read_text("utf-8").splitlines() if facts.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or provenance.UNKNOWN
