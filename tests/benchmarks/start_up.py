"""What comes before the first task: the command line, and kernels that are compiled once and for all."""

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
from tests.benchmarks.table import Row, at_most, best, seconds, timed, verdict, versus

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "smoke.toml"
HEAVY = ("xarray", "pandas", "matplotlib", "pydantic", "rich")
RANK = f"""
import sys
from pathlib import Path
from nanoslip.study.run.launch import task_program
task_program(Path("nowhere")).load()
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
    """Commands that compute nothing, and runs with empty and with filled caches of kernels."""
    with TemporaryDirectory() as folder:
        looks = _looks(Path(folder))
    return [*looks, *_kernels()]


def _looks(folder: Path) -> list[Row]:
    """Commands at a finished campaign: processor time with the bytecode of their modules, as after any installation."""
    bytecode = dict(os.environ, PYTHONPYCACHEPREFIX=str(folder / "bytecode"))
    bytecode.pop("PYTHONDONTWRITEBYTECODE", None)
    finished = (str(CAMPAIGN), "--out", str(folder / "out"))
    started(0, "nanoslip", "run", *finished)
    commands = {("--help",): 0.4, ("status", *finished): 0.3, ("plan", *finished): 0.5, ("report", *finished): 3.5}
    faulty = folder / "faulty.toml"
    faulty.write_text(f"{CAMPAIGN.read_text('utf-8')}\n[nonsense]\nkey = 1\n", "utf-8")
    rows = [_command(*words, limit=limit, environment=bytecode) for words, limit in commands.items()]
    return [*rows, _command("run", str(faulty), limit=0.6, environment=bytecode, of=" of a faulty campaign", code=2)]


def _command(*arguments: str, limit: float, environment: dict[str, str], of: str = "", code: int = 0) -> Row:
    """code: the exit code that it is to have."""
    script = Path(sys.executable).with_name("nanoslip")
    words = [str(script)] if script.exists() else [sys.executable, "-m", "nanoslip"]
    took = best(_quiet([*words, *arguments], environment, code), clock=_children)
    python = best(_quiet([sys.executable, "-c", "pass"], environment), clock=_children)
    what, ratio = f"nanoslip {arguments[0]}{of}: processor time", f"{took / python:.1f}"
    return versus(what, took, python, "Python alone", at_most(took, limit), ratio=ratio)


def _kernels() -> list[Row]:
    with TemporaryDirectory() as one, TemporaryDirectory() as four:
        cold, warm = _run(0, one, "cold"), _run(0, one, "warm")
        together, again = _run(4, four, "cold"), _run(4, four, "warm")
    # Four ranks that compile each for themselves take the processor for four times the difference.
    compiling = cold.processor - warm.processor
    times = (together.processor - again.processor) / compiling
    same = again.kernels == together.kernels and len(together.kernels) == len(cold.kernels)
    second, again_compiled = _compiled(cold, warm), _compiled(together, again)
    what, ours = f"second run, {len(cold.kernels)} kernels in the cache: compiled", f"{second}, in {seconds(warm.wall)}"
    fewer, once = f"{cold.wall / warm.wall:.1f} × as fast", verdict("once, not four times", times < 1.5)
    four, left = "4 ranks, empty cache", f"{len(together.kernels)}, {again_compiled}"
    of_one = f"{len(cold.kernels)}, {second} (one process)"
    return [
        Row(what, ours, f"{seconds(cold.wall)} (first run)", fewer, verdict("0", second == 0)),
        versus(f"{four}: time for compiling", times * compiling, compiling, "one process", once),
        Row(f"{four}: kernels cached, compiled by the next run", left, of_one, "", verdict("the same", same)),
    ]


def _compiled(before: Run, after: Run) -> int:
    """Kernels that a run compiled although an earlier one had."""
    return len(after.kernels.items() - before.kernels.items())


def _run(ranks: int, cache: str, out: str) -> Run:
    used, words = _children(), (ranks, "nanoslip", "run", CAMPAIGN, "--out", Path(cache) / out)
    _, wall = timed(lambda: started(*words, NUMBA_CACHE_DIR=str(Path(cache) / "kernels")), time.perf_counter)
    processor = _children() - used
    kernels = {str(path): path.stat().st_mtime_ns for path in Path(cache).rglob("*.nbc")}
    return Run(wall, processor, kernels)


def _children() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _quiet(words: list[str], environment: dict[str, str] | None = None, code: int = 0) -> Callable[[], object]:
    def ended() -> None:
        done = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False, env=environment)
        if done.returncode != code:
            raise RuntimeError(f"{words}: ended with {done.returncode}, not {code}")

    return ended
