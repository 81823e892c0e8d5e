"""The farm: what it adds to each task, how well two ranks share, and what thousands of ranks would make of it.

Started with arguments, this module is the program that the ranks run: `MODE FOLDER COUNT`.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from nanoslip.solver.outcome import COMPLETED, Outcome
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.plan.task import Task, TaskResult
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task
from nanoslip.study.run.dispatch import Watch, lookahead
from nanoslip.study.run.farm import Farm, ProcessFarm
from nanoslip.study.run.launch import Program
from nanoslip.study.run.mpi import MPIFarm, open_farm
from nanoslip.study.run.warm_up import miniatures, warm_up
from tests.benchmarks import campaign
from tests.benchmarks.ranks import found
from tests.benchmarks.replay import Cost, Timed, replay
from tests.benchmarks.table import Row, seconds, timed, verdict, versus
from tests.study.run.made_up import Work

CASES = """\
title = "{count} cases at 129 nodes, 2000 events each"
stages = {stages}
[axes]
intrinsic_friction = {intrinsic_friction}
radius = [50.0, 100.0, 150.0, 200.0, 250.0]
[limits]
events = 2000
[ensemble]
members = 1
"""
DRIVE = '[[drives]]\nname = "paper"\n'
TRIVIAL = 10_000
RANKS = (64, 1024, 5000, 16384)
MANY = RANKS[2]
"""Ranks that the coordinator is to feed: what a task costs it depends a little on how many it hands out at once."""
MESSAGES, PARCELS = 2000, (1, 16)
"""Parcels that are timed, and how many tasks are in each."""
OTHER = "processor"
"""File in which a rank but the root leaves its processor seconds."""
REPLAYED = 500_000
"""Cases of the replayed campaign; each is a friction record and a drive of it."""


def rows() -> list[Row]:
    """What the farm costs per task, what two ranks gain, and the replay."""
    # Folders go when all is measured: a file system may take its time to make files right after many were deleted.
    with TemporaryDirectory() as folder:
        return [*_trivial(Path(folder)), *_shared(Path(folder)), *_replayed(Path(folder))]


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
    _describe(folder, 200, '["contact", "slip"]')
    serial, pair = [], []
    for attempt in range(2):  # in turn: what else the machine does should hit both
        serial.append(tuple(found(0, __name__, "cases", folder, f"alone{attempt}")))
        took, computing, used = found(2, __name__, "cases", folder, f"pair{attempt}")
        other = float((folder / f"pair{attempt}" / OTHER).read_text())
        pair.append((took, computing / (2 * took), used + other))
    peer = _run("futures", folder, "peer", 2)
    (alone, _, used_alone), (ours, share, used_by_both) = min(serial), min(pair)
    wall, undisturbed = alone / ours, 2 * share * used_alone / used_by_both
    both = f"ranks compute {share:.1%} of the wall clock; tasks are slower"
    rows = (
        (
            "n_x = 129, 2 ranks, wall clock",
            ours,
            alone,
        ),
        (f"n_x = 129, in processor time: {both} on shared caches", used_by_both, used_alone),
    )
    return [
        *(
            versus(
                f"200 cases at {what}",
                *(mine, one, "one process", verdict("≥ 1.9 × serial", gain >= 1.9)),
                ratio=f"{gain:.2f} × as fast",
            )
            for (what, mine, one), gain in zip(rows, (wall, undisturbed), strict=True)
        ),
        versus(
            "the same", ours, peer, "MPICommExecutor of mpi4py.futures, 2 ranks", ratio=f"{peer / ours:.2f} × as fast"
        ),
    ]


def _replayed(folder: Path) -> list[Row]:
    alone = found(0, __name__, "alone", folder, "alone0")
    driven = folder / "driven"
    driven.mkdir()
    _describe(driven, 20, '["contact", "slip", "dynamics"]', DRIVE)
    tasks = _resampled(found(0, __name__, "durations", driven, "out"))
    cost = _cost(driven, tasks)
    return [*(_replay_row(tasks, ranks, cost) for ranks in RANKS), *_limits(tasks, cost, alone)]


def _cost(driven: Path, tasks: list[Timed]) -> Cost:
    """What the root is at work for, from what many parcels of one task take it and few of many."""
    seen = [found(2, __name__, "messages", driven, size) for size in PARCELS]
    equations = [[count, messages] for _, count, messages in seen]
    per_task, per_message = np.linalg.solve(equations, [took for took, _, _ in seen])
    sending = Cost(float(per_task), float(per_message))
    own = replay(tasks, MANY, sending).own / len(tasks)
    return replace(sending, task=sending.task + own)


def _replay_row(tasks: list[Timed], ranks: int, cost: Cost) -> Row:
    seen = replay(tasks, ranks, cost)
    bound = max(sum(task.seconds for task in tasks) / ranks, *(task.seconds for task in tasks))
    return versus(
        f"replay: {len(tasks)} tasks on {ranks} ranks; coordinator busy {seen.coordinating / seen.makespan:.0%}, "
        f"{len(tasks) / seen.makespan:.2g} result files per s",
        *(seen.makespan, bound, "max(total/ranks, longest)"),
    )


def _limits(tasks: list[Timed], cost: Cost, alone: Mapping[str, float]) -> list[Row]:
    """What gives way first as ranks are added: the coordinator, or the root alone before and after the run."""
    mean = sum(task.seconds for task in tasks) / len(tasks)
    root = sum(alone.values())
    # A message there and one back in half the lookahead of each rank.
    share = 1.0 - RANKS[-1] * 2.0 * cost.message / (lookahead(RANKS[-1]) / 2.0)
    return [
        Row(
            f"limit during a run: the coordinator, {seconds(cost.task)} a task and {seconds(cost.message)} "
            f"a message; {RANKS[-1]} ranks need tasks of {seconds(RANKS[-1] * cost.task / share)}",
            f"feeds {mean * share / cost.task:.0f} ranks",
            f"tasks of {seconds(mean)} on average",
        ),
        Row(
            f"limit around it: the root plans ({seconds(alone['plan'])} a task), checks results "
            f"({seconds(alone['check'])} a file of 134 kB) and collects ({seconds(alone['collect'])})",
            f"{seconds(root * len(tasks))} for {len(tasks)} tasks",
            "the tasks themselves",
            f"as long on {mean / root:.0f} ranks",
        ),
    ]


def _resampled(durations: Mapping[str, list[float]]) -> list[Timed]:
    """A campaign in a plan's order whose tasks last as measured ones did (fixed seed): records first, then drives."""
    generator = np.random.default_rng(20220101)
    records = generator.choice(durations["record"], REPLAYED)
    drives = generator.choice(durations["drive"], REPLAYED)
    mean = {kind: float(np.mean(values)) for kind, values in durations.items()}
    first = Timed("compliance", (), mean["compliance"], "compliance", seconds=mean["compliance"])
    tasks = [first]
    for case, took in enumerate(records):
        tasks.append(Timed(f"f{case}", ("compliance",), mean["record"], "record", seconds=float(took)))
    for case, took in enumerate(drives):
        tasks.append(Timed(f"d{case}", (f"f{case}",), mean["drive"], "drive", seconds=float(took)))
    return tasks


def _run(mode: str, folder: Path, what: object, ranks: int) -> float:
    return float(found(ranks, __name__, mode, folder, what))


def _describe(folder: Path, count: int, stages: str, drive: str = "") -> None:
    friction = np.linspace(0.2, 0.5, count // 5).round(6).tolist()
    (folder / "cases.toml").write_text(
        CASES.format(count=count, stages=stages, intrinsic_friction=friction) + drive, "utf-8"
    )


def _program(mode: str, folder: Path, what: str) -> None:
    """What the ranks run; the root prints its finding as JSON."""
    if mode == "futures":
        _futures(folder, what)
        return
    if mode == "alone":
        print(json.dumps(_alone(folder, folder / what)))
        return
    made_up = mode in ("trivial", "written", "messages")
    with open_farm(Program(__name__, "executor", (mode, folder, what))) as farm:
        if not farm.root:
            code = farm.serve()
            if mode == "cases":
                (folder / what / OTHER).write_text(str(_processor_seconds(farm)))
            farm.leave(code)
        if mode == "messages":
            assert isinstance(farm, MPIFarm)
            finding: Any = _messages(farm, _plan(folder).tasks, int(what))
        elif made_up:
            Store(folder).prepare()
            tasks = [Work(f"{number:020x}") for number in range(int(what))]
            _begin(farm)
            _, finding = timed(lambda: farm.run(tasks, Watch()), time.perf_counter)
        else:
            finding = _campaign(farm, mode, folder, folder / what)
        print(json.dumps(finding), flush=True)
        farm.leave(0)


def executor(given: tuple[str, Path, str]) -> Callable[[Any], Outcome]:
    """What a child computes tasks with, its kernels loaded (0.2 s): that is start-up, over before tasks are timed."""
    mode, folder, what = given
    if mode in ("trivial", "messages"):
        return lambda task: COMPLETED
    if mode == "written":
        return _files(folder)
    warm_up(miniatures(_plan(folder).tasks))
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


def _campaign(farm: Farm, mode: str, folder: Path, out: Path) -> Any:
    """Seconds of the task phase, of computing on all ranks, of this rank's processor from its start; or of each task by kind."""
    plan = _plan(folder)
    Store(out).prepare()
    durations: dict[str, list[float]] = {}
    _begin(farm)

    def report(task: Task, _: Outcome, seconds: float) -> None:
        durations.setdefault(task.kind, []).append(seconds)

    _, took = timed(lambda: farm.run(plan.tasks, Watch(report)), time.perf_counter)
    used = _processor_seconds(farm)
    return durations if mode == "durations" else (took, sum(map(sum, durations.values())), used)


def _alone(folder: Path, out: Path) -> dict[str, float]:
    """Seconds per task of what the root does by itself before and after a finished campaign's run, its libraries loaded."""
    from nanoslip.study.dataset import file
    from nanoslip.study.dataset.collect import collect

    store = Store(out)

    def collected() -> None:
        file.write(collect(plan, store), out / file.FILE)

    plan, planning = timed(lambda: _plan(folder), time.perf_counter)
    _, checking = timed(store.finished, time.perf_counter)
    collected()
    _, collecting = timed(collected, time.perf_counter)
    took = {"plan": planning, "check": checking, "collect": collecting}
    return {name: value / len(plan.tasks) for name, value in took.items()}


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


def _messages(farm: MPIFarm, tasks: Sequence[Task], size: int) -> tuple[float, int, int]:
    """Processor seconds of the root for parcels of this size, there, and their news back; how many tasks and messages."""
    given, ended, messages = MESSAGES * size, 0, MESSAGES
    some = [replace(tasks[number % len(tasks)], key=f"{number:020x}") for number in range(given)]
    start = time.thread_time()
    for first in range(0, given, size):
        farm._send(1, some[first : first + size])
    while ended < given:
        arrived = farm._received()
        messages += len(arrived)
        ended += sum(len(done) for _, (done, _) in arrived)
        if not arrived:
            time.sleep(1e-3)
    return time.thread_time() - start, given, messages


_store: Store | None = None


def _submitted(task: Task) -> Outcome:
    assert _store is not None
    return _executor(_store)(task)


def _futures(folder: Path, what: str) -> None:
    """The same tasks through mpi4py's executor, whose root hands out and waits."""
    global _store  # noqa: PLW0603  an executor takes module functions only
    from mpi4py.futures import MPICommExecutor

    _store = Store(folder / what)
    warm_up(miniatures(_plan(folder).tasks))
    with MPICommExecutor() as executor:
        if executor is not None:
            plan = _plan(folder)
            _store.prepare()
            start = time.perf_counter()
            pool: Any = executor  # mpi4py's own types leave `map` out
            for kind in ("compliance", "record"):
                list(pool.map(_submitted, [task for task in plan.tasks if task.kind == kind]))
            print(json.dumps(time.perf_counter() - start), flush=True)


if __name__ == "__main__":
    campaign._program(sys.argv[1], Path(sys.argv[2]), sys.argv[3])  # whose classes children know by that name
