"""The table of faults: what each does to a run of one process, and on each of two ranks. `python -m` this module writes it."""

import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.conftest import launcher
from tests.study.execution.farms.faults import FAULTS
from tests.study.execution.made_up import LIMIT

README = Path(__file__).with_name("README.md")
PROGRAM = "tests.study.execution.farms.fault_program"
WHERE = (("one process", 0, 0), ("rank 0 of 2", 2, 0), ("rank 1 of 2", 2, 1))
"""Heading -> processes that a launcher starts, and the rank that meets the fault."""
HEAD = f"""# What a task can do to its process

Each fault is one task among 19 sound ones; `python -m tests.study.execution.farms.matrix` writes this table. Cells: how many of
the others were finished, how the faulty one ended, how long the run took, with the start of all processes. A time limit of
{LIMIT:g} s stands in for the usual 100 times the estimate; a task whose process dies is tried twice.

| fault | {" | ".join(heading for heading, _, _ in WHERE)} |
|---|{"---|" * len(WHERE)}
"""


def cell(fault: str, ranks: int, rank: int) -> str:
    """What came of one run."""
    with TemporaryDirectory() as folder:
        words = [*launcher(ranks), sys.executable, "-m", PROGRAM, fault, str(rank), folder]
        begun = time.perf_counter()
        done = subprocess.run(words, capture_output=True, text=True, timeout=120.0, check=False)
        seconds = time.perf_counter() - begun
    try:
        said = json.loads(done.stdout)
    except ValueError:
        return f"exit code {done.returncode}: {done.stdout!r}"
    return f"{said['done']} of 19, `{said['ending']}`, {seconds:.1f} s"


def main() -> None:
    """Write the table."""
    rows = [f"| {fault} | {' | '.join(cell(fault, ranks, rank) for _, ranks, rank in WHERE)} |\n" for fault in FAULTS]
    README.write_text(HEAD + "".join(rows), "utf-8")


if __name__ == "__main__":
    main()
