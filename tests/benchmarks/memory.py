"""What a shared compliance costs the ranks of a node.

Started with arguments, this module is one such rank: `FOLDER KEY`; it reports when it is told to, while all of them live.
"""

import json
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from subprocess import PIPE
from tempfile import TemporaryDirectory

from nanoslip.solver.case import Case
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.kinds import compliance_task, record_task
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results import entry as own
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task
from tests.benchmarks.table import Row, verdict

SLAB = Slab(n_x=1025)
ONE_SLAB = """\
title = "Twelve cases, two drives each, on one slab"
[axes]
intrinsic_friction = [0.2, 0.3, 0.4, 0.5]
radius = [50.0, 100.0, 200.0]
[ensemble]
members = 1
[[drives]]
name = "slow"
stage_velocity = 1e-3
[[drives]]
name = "fast"
"""


def rows() -> list[Row]:
    """Memory of one rank and of four with the same compliance, and how often a campaign computes it."""
    with TemporaryDirectory() as folder:
        return [*_shared(Path(folder)), _computed_once(Path(folder))]


def _shared(folder: Path) -> list[Row]:
    store, task = Store(folder), compliance_task(SLAB)
    store.prepare()
    store.write(run_task(task, {}), shared=True)
    size = (2 * SLAB.n_x) ** 2 * 8 / 1e6
    found = []
    for ranks in (1, 4):
        each = _ranks(ranks, folder, task.key)
        mapped = sum(rank["mapped"] for rank in each)
        what = f"{ranks} ranks of a node sharing a compliance, n_x = 1025"
        resident, proportional = (sum(rank[name] for rank in each) / ranks for name in ("Rss", "Pss"))
        ours = f"{mapped:.1f} MB; a rank: {resident:.0f} MB resident, {proportional:.0f} MB proportional"
        target = verdict("one copy", mapped <= 1.01 * size)  # a page more at either end
        found.append(Row(what, ours, f"{size:.1f} MB (one copy)", f"{mapped / size:.2f}", target))
    return found


def _computed_once(folder: Path) -> Row:
    path = folder / "one.toml"
    path.write_text(ONE_SLAB, "utf-8")
    plan = make_plan(load_manifest(path))
    count = sum(task.kind == "compliance" for task in plan.tasks)
    what = f"compliances for {len(plan.cases)} cases (4 μ_i, 3 R) of one slab"
    return Row(what, str(count), "1", f"{count:g}", verdict("1", count == 1))


def _ranks(count: int, folder: Path, key: str) -> list[dict[str, float]]:
    """Memory in MB of so many processes, measured while all of them hold the compliance."""
    words = [sys.executable, "-m", __name__, str(folder), key]
    with ExitStack() as stack:
        started = [
            stack.enter_context(subprocess.Popen(words, stdin=PIPE, stdout=PIPE, text=True)) for _ in range(count)
        ]
        found = []
        for rank in started:
            _line(rank)
        for rank in started:
            _tell(rank)
            found.append(json.loads(_line(rank)))
        for rank in started:
            _tell(rank)
    return found


def _line(rank: "subprocess.Popen[str]") -> str:
    assert rank.stdout is not None
    return rank.stdout.readline()


def _tell(rank: "subprocess.Popen[str]") -> None:
    assert rank.stdin is not None
    rank.stdin.write("\n")
    rank.stdin.flush()


def _program(folder: Path, key: str) -> None:
    """Read the compliance, use every page of it, slide on it, then tell what memory that takes."""
    compliance = Store(folder).read(key)
    compliance.arrays["matrix"].sum()
    result = run_task(record_task(Case(slab=SLAB, radius=200.0, max_events=20)), {key: compliance})
    assert result.outcome.usable, result.outcome
    print("ready", flush=True)
    sys.stdin.readline()
    print(json.dumps(_memory(own.path_of(folder, key).name)), flush=True)
    sys.stdin.readline()


def _memory(mapped: str) -> dict[str, float]:
    """This process's memory in MB: all of it, resident and proportional, and its proportional part of the mapped file."""
    rollup = Path("/proc/self/smaps_rollup").read_text("ascii").splitlines()
    whole = {words[0][:-1]: int(words[1]) * 1024e-6 for line in rollup if len(words := line.split()) == 3}
    parts, inside = 0.0, False
    for line in Path("/proc/self/smaps").read_text("utf-8").splitlines():
        words = line.split()
        if not words[0].endswith(":"):
            inside = words[-1].endswith(mapped)
        elif inside and words[0] == "Pss:":
            parts += int(words[1]) * 1024e-6
    return {"Rss": whole["Rss"], "Pss": whole["Pss"], "mapped": parts}


if __name__ == "__main__":
    _program(Path(sys.argv[1]), sys.argv[2])
