"""The farm: what it adds to each task, and how well two ranks share.

Started with arguments, this module is the program that the ranks run: `MODE FOLDER COUNT`.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.dispatch import Watch
from nanoslip.study.run.executor import WarmUp, miniatures
from nanoslip.study.run.farm import Farm, ProcessFarm, open_farm
from nanoslip.study.run.launch import Program
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.task import Task, TaskResult
from tests.benchmarks import campaign
from tests.benchmarks.ranks import found
from tests.benchmarks.table import Row, seconds, timed, verdict, versus
from tests.study.run.made_up import Work

CASES = """\
title = "{count} cases at 129 nodes, 2000 events each"
stages = ["contact", "slip"]
[axes]
intrinsic_friction = {intrinsic_friction}
radius = [50.0, 100.0, 150.0, 200.0, 250.0]
[limits]
events = 2000
[ensemble]
members = 1
"""
TRIVIAL = 10_000
OTHER = "processor"
"""File in which a rank but the root leaves its processor seconds."""


def rows() -> list[Row]:
    """What the farm costs per task, and what two ranks gain."""
    # Folders go when all is measured: a file system may take its time to make files right after many were deleted.
    with TemporaryDirectory() as folder:
        return [*_trivial(Path(folder)), *_shared(Path(folder))]


def _trivial(folder: Path) -> list[Row]:
    target = "≤ 0.5 ms per task"
    bare = min(_run("trivial", folder, TRIVIAL, 2) for _ in range(2)) / TRIVIAL
    alone = _run("written", folder / "alone", TRIVIAL // 4, 0) / (TRIVIAL // 4)
    written = min(_run("written", folder / f"pair{attempt}", TRIVIAL, 2) for attempt in range(2)) / TRIVIAL
    what = f"{TRIVIAL} trivial tasks, 2 ranks, each"
    files, name = f"{what}, result file written and synced", "one process, mostly fsync"
    return [
        Row(f"{what}, no files", seconds(bare), "0.5 ms", f"{bare / 5e-4:.2g}", verdict(target, bare <= 5e-4)),
        versus(files, written, alone, name, verdict(target, written <= 5e-4)),
    ]


def _shared(folder: Path) -> list[Row]:
    _describe(folder, 200)
    serial, pair = [], []
    for attempt in range(2):  # in turn: what else the machine does should hit both
        serial.append(tuple(found(0, __name__, "cases", folder, f"alone{attempt}")))
        took, computing, used = found(2, __name__, "cases", folder, f"pair{attempt}")
        other = float((folder / f"pair{attempt}" / OTHER).read_text())
        pair.append((took, computing / (2 * took), used + other))
    (alone, _, used_alone), (ours, share, used_by_both) = min(serial), min(pair)
    both = f"ranks compute {share:.1%} of the wall clock; tasks are slower"
    rows = (
        ("n_x = 129, 2 ranks, wall clock", ours, alone, alone / ours),
        (
            f"n_x = 129, in processor time: {both} on shared caches",
            *(used_by_both, used_alone, 2 * share * used_alone / used_by_both),
        ),
    )
    return [
        versus(
            f"200 cases at {what}",
            *(mine, one, "one process", verdict("≥ 1.9 × serial", gain >= 1.9)),
            ratio=f"{gain:.2f} × as fast",
        )
        for what, mine, one, gain in rows
    ]


def _run(mode: str, folder: Path, what: object, ranks: int) -> float:
    return float(found(ranks, __name__, mode, folder, what))


def _describe(folder: Path, count: int) -> None:
    friction = np.linspace(0.2, 0.5, count // 5).round(6).tolist()
    (folder / "cases.toml").write_text(CASES.format(count=count, intrinsic_friction=friction), "utf-8")


def _program(mode: str, folder: Path, what: str) -> None:
    """What the ranks run; the root prints its finding as JSON."""
    with open_farm(Program(__name__, "executor", (mode, folder, what))) as farm:
        if not farm.root:
            code = farm.serve()
            if mode == "cases":
                (folder / what / OTHER).write_text(str(_processor_seconds(farm)))
            farm.leave(code)
        if mode == "cases":
            finding: Any = _campaign(farm, folder, folder / what)
        else:
            Store(folder).prepare()
            tasks = [Work(f"{number:020x}") for number in range(int(what))]
            _begin(farm)
            _, finding = timed(lambda: farm.run(tasks, Watch()), time.perf_counter)
        print(json.dumps(finding), flush=True)
        farm.leave(0)


def executor(given: tuple[str, Path, str]) -> Callable[[Any], Outcome]:
    """What a child computes tasks with, its kernels loaded (0.2 s): that is start-up, over before tasks are timed."""
    mode, folder, what = given
    if mode == "trivial":
        return lambda task: COMPLETED
    if mode == "written":
        return _files(folder)
    WarmUp(miniatures(_plan(folder).tasks)).run()
    compute = _executor(Store(folder / what))
    return lambda task: COMPLETED if isinstance(task, Work) else compute(task)


def _begin(farm: Farm) -> None:
    """Have every child started, its libraries loaded."""
    farm.run([Work(f"begin {number}") for number in range(farm.size)], Watch())


def _processor_seconds(farm: Farm) -> float:
    """Of this process and its children, which end."""
    agents = farm._agents if isinstance(farm, ProcessFarm) else [farm._agent]  # type: ignore[attr-defined]
    for agent in agents:
        agent.close()
    return sum(os.times()[:4])


def _campaign(farm: Farm, folder: Path, out: Path) -> tuple[float, float, float]:
    """Seconds of the task phase, of computing on all ranks, of this rank's processor from its start."""
    Store(out).prepare()
    each: list[float] = []
    _begin(farm)

    def report(task: Task, _: Outcome, seconds: float) -> None:
        each.append(seconds)

    _, took = timed(lambda: farm.run(_plan(folder).tasks, Watch(report)), time.perf_counter)
    return took, sum(each), _processor_seconds(farm)


def _plan(folder: Path) -> Plan:
    return make_plan(load_manifest(folder / "cases.toml"))


def _executor(store: Store) -> Callable[[Task], Outcome]:
    def execute(task: Task) -> Outcome:
        result = run_task(task, {key: store.read(key) for key in task.needs})
        store.write(result)
        return result.outcome

    return execute


def _files(folder: Path) -> Callable[[Any], Outcome]:
    store = Store(folder)

    def execute(task: Work) -> Outcome:
        store.write(TaskResult(task.key, "record", COMPLETED, {"plateau_mean": 0.0}, {"step": np.zeros(10)}))
        return COMPLETED

    return execute


if __name__ == "__main__":
    campaign._program(sys.argv[1], Path(sys.argv[2]), sys.argv[3])  # whose classes children know by that name
