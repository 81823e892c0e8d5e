"""The runs that computed a dataset, for its page: their time in a sentence, and a table."""

from collections.abc import Sequence
from typing import Final

from study.exit_codes import CRASHED, FAILURES, INTERRUPTED, WRONG_INPUT
from study.report.columns import Table
from study.report.common import NOTHING
from study.results.attempts import RUNS_FILE as FILE
from study.results.attempts import Run

MOST_RUNS: Final = 20
"""Runs that a table shows: the last ones."""
_WORDS: Final = {
    0: "complete",
    CRASHED: "crashed",
    WRONG_INPUT: "refused: the disk, or the input",
    FAILURES: "complete but for failed tasks",
    INTERRUPTED: "interrupted",
}


def cost(runs: Sequence[Run]) -> str:
    """Time and processes of all runs of a campaign, in a sentence."""
    ended = [run for run in runs if run.ended]
    if not ended:
        return "Not known: nothing beside the dataset says what its runs took."
    wall, core = sum(run.wall_seconds for run in ended), sum(run.core_seconds for run in ended)
    most = max(run.processes for run in ended)
    processes = "one process" if most == 1 else f"up to {most} processes"
    times = f"{len(ended)} runs" if len(ended) > 1 else "one run"
    tasks = sum(run.done + run.failed for run in ended)
    missing = len(runs) - len(ended)
    further = f" {missing} more did not come to their end." if missing else ""
    return f"{_time(wall)} in {times} with {processes}; {tasks} tasks took {_time(core)} of one core.{further}"


def run_table(runs: Sequence[Run]) -> tuple[Table, list[str]]:
    """One row for each of the last runs; and sentences with common values, and the number of runs not shown."""
    shown = runs[-MOST_RUNS:]
    facts = [_facts(run) for run in shown]
    values = {name: [each.get(name) or NOTHING for each in facts] for each in facts for name in each}
    alike = {name: found[0] for name, found in values.items() if len(set(found)) == 1}
    told = {name: found for name, found in values.items() if name not in alike}
    rows = tuple((*_times(run), *(found[row] for found in told.values()), run.command) for row, run in enumerate(shown))
    common = "; ".join(f"{name} {value}" for name, value in alike.items() if value != NOTHING)
    sentences = [f"{'All' if len(shown) > 1 else 'By'}: {common}."] if common else []
    if left := len(runs) - len(shown):
        sentences.append(f"{left} earlier ones are in {FILE} beside the dataset.")
    failed = frozenset(number for number, run in enumerate(shown) if not run.ended or run.exit_code)
    return Table((*_TIMES, *told, "command"), rows, 1, failed), sentences


_TIMES: Final = ("began (UTC)", "end", "took", "core time", "tasks", "failed", "processes")


def _times(run: Run) -> tuple[str, ...]:
    began, processes = run.begun[:19].replace("T", " "), f"{run.processes} {run.unit}"
    if not run.ended:
        return began, _end(run), *(NOTHING,) * 4, processes
    return began, _end(run), _time(run.wall_seconds), _time(run.core_seconds), str(run.done), str(run.failed), processes


def _facts(run: Run) -> dict[str, str]:
    """What runs mostly have in common."""
    return {
        "user": run.user,
        "hosts": ", ".join(f"{host}: {count}" for host, count in run.hosts.items()) or run.host,
        "Slurm job": run.slurm_job,
        "launcher": run.launcher,
        "MPI": run.mpi,
        "nanoslip": run.nanoslip,
        "solver": run.solver,
        "processor": run.processor,
        "BLAS": run.blas,
        "Python": run.python,
        **run.libraries,
    }


def _end(run: Run) -> str:
    if not run.ended:
        return "none: at work, or killed"
    return _WORDS.get(run.exit_code, f"exit code {run.exit_code}")


def _time(seconds: float) -> str:
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
