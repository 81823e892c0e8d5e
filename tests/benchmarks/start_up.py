"""What comes before the first task: the command line, imports, and kernels that are compiled once and for all."""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.benchmarks.ranks import started
from tests.benchmarks.table import Row, best, seconds, verdict

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "smoke.toml"
HEAVY = ("xarray", "pandas", "matplotlib", "pydantic", "rich")
RANK = f"""
import sys
from pathlib import Path
from nanoslip.study.run.launch import computing
computing(Path("nowhere")).load()
print(*(name for name in {HEAVY} if name in sys.modules))
"""


@dataclass(frozen=True)
class Run:
    """One run of the smoke campaign, and the compiled kernels that were in its cache when it had ended."""

    wall: float
    """Seconds, start-up and dataset included."""
    processor: float
    """Processor seconds of all its ranks."""
    kernels: dict[str, int]
    """File of a compiled kernel -> when it was written."""


def rows() -> list[Row]:
    """Commands that compute nothing, a rank's imports, and runs with empty and with filled caches of kernels."""
    with TemporaryDirectory() as folder:
        looks = _looks(Path(folder))
    return [*looks, _imports(), *_kernels()]


def _looks(folder: Path) -> list[Row]:
    """Commands at a finished campaign: processor time with the bytecode of their modules, as after any installation."""
    bytecode = dict(os.environ, PYTHONPYCACHEPREFIX=str(folder / "bytecode"))
    bytecode.pop("PYTHONDONTWRITEBYTECODE", None)
    finished = (str(CAMPAIGN), "--out", str(folder / "out"))
    started(0, "nanoslip", "run", *finished)
    limits = {"--help": 0.4, "status": 0.3, "plan": 0.5, "report": 1.2}
    return [
        _command(name, *(finished if name != "--help" else ()), limit=limit, environment=bytecode)
        for name, limit in limits.items()
    ]


def _command(*arguments: str, limit: float, environment: dict[str, str]) -> Row:
    script = Path(sys.executable).with_name("nanoslip")
    words = [str(script)] if script.exists() else [sys.executable, "-m", "nanoslip"]
    took = best(_quiet([*words, *arguments], environment), clock=_children)
    python = best(_quiet([sys.executable, "-c", "pass"], environment), clock=_children)
    against = f"{seconds(python)}: Python alone"
    target = verdict(f"≤ {limit} s", took <= limit)
    return Row(f"nanoslip {arguments[0]}: processor time", seconds(took), against, f"{took / python:.1f}", target)


def _imports() -> Row:
    loaded = subprocess.run([sys.executable, "-c", RANK], capture_output=True, text=True, check=True).stdout.split()
    took = best(_quiet([sys.executable, "-c", RANK]), repeats=3, clock=time.perf_counter)
    solver = best(_quiet([sys.executable, "-c", "import numpy, numba, scipy.optimize"]), 3, time.perf_counter)
    return Row(
        f"a rank ready to compute; of {', '.join(HEAVY)} it has loaded: {', '.join(loaded) or 'none'}",
        seconds(took),
        f"{seconds(solver)}: numpy, numba and scipy.optimize alone",
        f"{took / solver:.2f}",
        verdict("none", not loaded),
    )


def _kernels() -> list[Row]:
    with TemporaryDirectory() as one, TemporaryDirectory() as four:
        cold, warm = _run(0, one, "cold"), _run(0, one, "warm")
        together, again = _run(4, four, "cold"), _run(4, four, "warm")
    # Four ranks that compile each for themselves take the processor for four times the difference.
    compiling = cold.processor - warm.processor
    times = (together.processor - again.processor) / compiling
    same = again.kernels == together.kernels and len(together.kernels) == len(cold.kernels)
    return [
        Row(
            f"second run, {len(cold.kernels)} kernels in the cache: how many it compiled",
            f"{_compiled(cold, warm)}, in {seconds(warm.wall)}",
            f"{seconds(cold.wall)}: first run",
            f"{cold.wall / warm.wall:.1f} × as fast",
            verdict("0", _compiled(cold, warm) == 0),
        ),
        Row(
            "4 ranks, empty cache: processor time for compiling",
            seconds(together.processor - again.processor),
            f"{seconds(compiling)}: one process",
            f"{times:.2f}",
            verdict("once, not four times", times < 1.5),
        ),
        Row(
            "4 ranks, empty cache: kernels they leave, and how many the next run compiles",
            f"{len(together.kernels)}, {_compiled(together, again)}",
            f"{len(cold.kernels)}, {_compiled(cold, warm)}: one process",
            "",
            verdict("the same", same),
        ),
    ]


def _compiled(before: Run, after: Run) -> int:
    """Kernels that a run compiled although an earlier one had."""
    return len(after.kernels.items() - before.kernels.items())


def _run(ranks: int, cache: str, out: str) -> Run:
    begun, used = time.perf_counter(), _children()
    folder = Path(cache) / out
    started(ranks, "nanoslip", "run", CAMPAIGN, "--out", folder, NUMBA_CACHE_DIR=str(Path(cache) / "kernels"))
    wall, processor = time.perf_counter() - begun, _children() - used
    kernels = {str(path): path.stat().st_mtime_ns for path in Path(cache).rglob("*.nbc")}
    return Run(wall, processor, kernels)


def _children() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _quiet(words: list[str], environment: dict[str, str] | None = None) -> Callable[[], object]:
    return lambda: subprocess.run(words, stdout=subprocess.DEVNULL, check=True, env=environment)
