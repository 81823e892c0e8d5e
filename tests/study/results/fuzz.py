"""Damage the files of a campaign and write the table of what came of it: `python -m tests.study.results.fuzz`.

A small campaign has ended, with one task that failed. After each damage to a copy of its folder a run goes on in this process,
with known results in the place of computed ones.
"""

import argparse
import io
import os
import random
import shutil
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final
from unittest.mock import patch

from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import NOTE
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import here
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results import attempts, entry as own, store as lease
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import FOLDER, Lease, Store, StoreError
from nanoslip.study.run.campaign import tasks_to_do
from nanoslip.study.run.dispatch import RunTally
from nanoslip.study.run.executor import executor
from nanoslip.study.run.journal import Journal
from nanoslip.study.run.launch import pin_arithmetic
from nanoslip.study.tasks.task import TaskResult
from tests.study.results.results import OBSTACLES, flipped
from tests.written_tables import show

ALL_BITS: Final = 10_000
CUTS: Final = 100
THOROUGH: Final = 200
"""The dataset is collected after one of so many damages; after the others the results that make it are compared."""
PATIENCE: Final = 60
"""Seconds after which a look at a folder is taken to block; each takes some milliseconds."""
CAMPAIGN: Final = """\
title = "A campaign whose files are damaged"
stages = ["contact", "slip", "dynamics"]
axes.intrinsic_friction = [0.25, 0.5]
constants.radius = 100.0
numerics.n_x = 17
limits.events = 20
outputs.fit = false

[[drives]]
name = "slow"
stage_velocity = 1e-3
samples = 10

[[drives]]
name = "fast"
samples = 10
"""


@dataclass(frozen=True)
class Finished:
    """The campaign, and what its folder has when nothing is damaged."""

    plan: Plan
    out: Path
    results: dict[str, TaskResult]
    failed: Attempt
    files: dict[str, Path]
    """Sort of file -> one of that sort, seen from the folder."""

    @property
    def failures(self) -> dict[str, Attempt]:
        """What the record of failures says."""
        return {self.failed.task: self.failed}


def finished(folder: Path) -> Finished:
    """Compute it in this process."""
    campaign, out = folder / "damaged.toml", folder / "out"
    campaign.write_text(CAMPAIGN, "utf-8")
    plan = make_plan(load_manifest(campaign))
    *tasks, last = plan.tasks
    journal, writers = Journal(out, "nanoslip run damaged.toml"), [executor(out), executor(out)]
    Store(out).prepare()
    journal.begin(2, "processes")
    for number, task in enumerate(tasks):
        writers[number % 2](task)
    failed = Attempt(
        last.key, last.label, "crashed", "a defect", True, False, here().solver, "rank 1", "2026-01-01T00:00:00+00:00"
    )
    for each in (replace(failed, final=False), failed):
        attempts.add_attempt(out, each)
    journal.computed(RunTally())
    journal.end(3)
    with Lease(out):
        running = (out / lease.FILE).read_text("utf-8")
    (out / lease.FILE).write_text(running, "utf-8")  # as a run leaves it that is killed
    write_dataset(plan, Store(out))
    results = {key: Store(out).read(key) for key in Store(out).finished()}
    return Finished(plan, out, results, failed, dict(_files(out, results)))


def _files(out: Path, results: dict[str, TaskResult]) -> Iterator[tuple[str, Path]]:
    logs = sorted((out / FOLDER).glob(f"*{own.LOGS}"))
    yield "a log of results", max(logs, key=lambda path: path.stat().st_size).relative_to(out)
    # Of a compliance nothing is wanted any more when its records are there.
    shared = [path for path in (out / FOLDER).glob(f"*{own.ENDING}") if results[path.stem].kind == "record"]
    yield "a result of its own", min(shared).relative_to(out)
    for name in (attempts.FILE, attempts.RUNS_FILE, lease.FILE, f"{FOLDER}/{NOTE}", file.FILE):
        yield f"`{name}`", Path(name)


# What is done to a file: each damage has a name, and takes the file.

Damage = tuple[str, Callable[[Path], object]]


def bits(whole: bytes, count: int, drawn: random.Random) -> Iterator[Damage]:
    """So many single bits of this content, or all where it has fewer."""
    for bit in drawn.sample(range(8 * len(whole)), min(count, 8 * len(whole))):
        yield f"bit {bit}", _written(flipped(whole, bit))


def rough(whole: bytes, others: list[Path], cuts: int, drawn: random.Random) -> Iterator[Damage]:
    """Everything else. others: files that it changes places with, seen from its folder."""
    for at in drawn.sample(range(len(whole)), min(cuts, len(whole))):
        yield f"cut at {at}", _written(whole[:at])
        for content in (bytes(64), drawn.randbytes(16)):
            yield f"{content!r} at {at}", _written(whole[:at] + content + whole[at + len(content) :])
        yield f"longer at {at}", _written(whole[:at] + b"?" + whole[at:])
    for content in (b"", whole + b"more"):
        yield f"{len(content)} bytes", _written(content)
    for other in others:
        yield f"changes places with {other}", _exchange(other)
    for name, place in OBSTACLES.items():
        yield name, _replaced(place)
    yield "a copy beside it", lambda path: shutil.copy(path, path.with_name(f"copy of {path.name}"))
    yield "strangers", _strangers


def _written(content: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(content)


def _replaced(place: Callable[[Path], object]) -> Callable[[Path], object]:
    return lambda path: (path.unlink(), place(path))


def _exchange(other: Path) -> Callable[[Path], object]:
    def exchange(path: Path) -> None:
        one, two = path.read_bytes(), (path.parent / other).read_bytes()
        path.write_bytes(two)
        (path.parent / other).write_bytes(one)

    return exchange


def _strangers(path: Path) -> None:
    """Names that no run gives, among them one that is no text, and one with the largest of numbers."""
    for name in (b"\xff\xfe", b"9" * 200, "²-μ".encode(), b"-", b" "):
        shutil.copy(os.fsencode(path), os.fsencode(path.parent) + b"/" + name + os.fsencode(path.suffix))


# What a run makes of it.


class Verdict(StrEnum):
    """What came of a damage; all from `SILENT` on are defects."""

    HARMLESS = "nothing is lost"
    NAMED = "named, done again"
    GONE = "as if never computed"
    REFUSED = "refused by name"
    SILENT = "lost without a word"
    WORDS = "another letter is shown"
    BLOCKED = "blocks"
    TRACEBACK = "traceback"
    NUMBERS = "other numbers"


SOUND: Final = frozenset((Verdict.HARMLESS, Verdict.NAMED, Verdict.GONE, Verdict.REFUSED))


class BlockedError(BaseException):
    """It takes too long. No Exception: nobody catches it on the way."""


class OtherNumbersError(Exception):
    """Something is used that nobody has computed."""


def verdict(finished: Finished, out: Path, damaged: Path, thorough: bool) -> tuple[Verdict, str]:
    """What came of a damage to this file, and more of it where it is a defect. thorough: the dataset is written, too."""
    said = io.StringIO()
    try:
        with _patience(), _hurried(), redirect_stderr(said), redirect_stdout(io.StringIO()):
            found = _look(finished, out, damaged, thorough)
    except BlockedError:
        return Verdict.BLOCKED, traceback.format_exc()
    except OtherNumbersError as error:
        return Verdict.NUMBERS, str(error)
    except StoreError as error:
        return (Verdict.REFUSED if damaged.name in str(error) else Verdict.SILENT), str(error)
    except Exception:
        return Verdict.TRACEBACK, traceback.format_exc()
    named = any(path.name in said.getvalue() for path in finished.files.values())  # two changed places, for example
    return (Verdict.NAMED, "") if found is Verdict.SILENT and named else (found, said.getvalue())


def _look(finished: Finished, out: Path, damaged: Path, thorough: bool) -> Verdict:
    refused = _read_dataset(finished, out) if damaged.name == file.FILE else False
    gone = _is_whole(out, damaged)
    with Lease(out):
        store = Store(out)
        store.prepare()
        inventory, failures = store.inventory(), store.failures()
        if any(own.pack_result(store.read(key)) != own.pack_result(finished.results[key]) for key in inventory):
            raise OtherNumbersError("a result that nobody has computed")
        attempts.read_runs(out)
        tasks = tasks_to_do(finished.plan, failures, inventory).tasks
        for task in tasks:
            if task.key in finished.results:
                store.write(finished.results[task.key], task.shared)
            else:
                attempts.add_attempt(out, finished.failed)
        if Store(out).seals() != Store(finished.out).seals():
            raise OtherNumbersError("results that are not those of before")
        if thorough and attempts.final(out, finished.failed.solver) == finished.failures:
            write_dataset(finished.plan, Store(out))
            if (out / file.FILE).read_bytes() != (finished.out / file.FILE).read_bytes():
                raise OtherNumbersError("another dataset")
    if tasks:
        return Verdict.GONE if gone else Verdict.SILENT
    if refused:
        return Verdict.REFUSED
    return Verdict.HARMLESS if failures == finished.failures else Verdict.WORDS


def _read_dataset(finished: Finished, out: Path) -> bool:
    """Whether the dataset is refused; else it must say the same."""
    with suppress(StoreError), file.reading(out / file.FILE) as found:
        with file.reading(finished.out / file.FILE) as right:
            if not found.load().identical(right.load()):
                raise OtherNumbersError("another dataset is read")
        return False
    return True


def _is_whole(out: Path, damaged: Path) -> bool:
    """Whether a file to which things are added has nothing but whole ones: nobody can know that there were more."""
    path = out / damaged
    if path.name == attempts.FILE:
        return not attempts.lost(out)
    is_log = path.suffix == own.LOGS and path.is_file()
    return is_log and not any(isinstance(found, own.Fault) for found in own.scan(path))


@contextmanager
def _patience() -> Iterator[None]:
    def block(*_: object) -> None:
        raise BlockedError

    before = signal.signal(signal.SIGALRM, block)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _hurried() -> Iterator[None]:
    """A lease is stale after a moment instead of a minute."""
    with patch.object(lease, "FRESH", 0.1), patch.object(lease, "BEAT", 0.01):
        yield


@dataclass
class Trials:
    """What came of damages of one sort to one sort of file."""

    sort: str
    what: str
    verdicts: Counter[Verdict] = field(default_factory=Counter)
    defects: list[str] = field(default_factory=list)

    def made(self, finished: Finished, damages: Iterable[Damage]) -> "Trials":
        """Do each damage to a copy of its own."""
        path, copy = finished.files[self.sort], finished.out.with_name("copy")
        for number, (name, damage) in enumerate(damages):
            shutil.copytree(finished.out, copy)
            damage(copy / path)
            found, more = verdict(finished, copy, path, number % THOROUGH == 0)
            self.verdicts[found] += 1
            if found not in SOUND:
                self.defects.append(f"{self.sort}, {name}: {found}\n{more}")
            shutil.rmtree(copy)
        return self


def trials(finished: Finished, count: int, cuts: int, seed: int, only: str = "") -> Iterator[Trials]:
    """Single bits, so many of each sort of file, and everything else. cuts: places that are cut, overwritten, put into.

    only: a part of the sorts that are damaged.
    """
    for sort, path in finished.files.items():
        if only not in sort:
            continue
        drawn, whole = random.Random(f"{seed} {sort}"), (finished.out / path).read_bytes()
        yield Trials(sort, "single bits").made(finished, bits(whole, count, drawn))
        others = [Path(os.path.relpath(other, path.parent)) for other in finished.files.values() if other != path]
        yield Trials(sort, "all else").made(finished, rough(whole, others, cuts, drawn))


def table(found: list[Trials]) -> list[list[object]]:
    """The trials, by sort of file and of damage."""
    every = sum((each.verdicts for each in found), Counter[Verdict]())
    shown = [what for what in Verdict if what in SOUND or every[what]]
    rows = ([each.sort, each.what, each.verdicts.total(), *(each.verdicts[what] for what in shown)] for each in found)
    return [["file", "damage", "times", *shown], *rows]


def main() -> None:
    """Do the damages; the table of a whole set of bits is written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bits", type=int, default=ALL_BITS, help="single bits of each sort of file")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="a part of the names of files that are damaged, such as results.nc")
    asked = parser.parse_args()
    pin_arithmetic()
    found = []
    with TemporaryDirectory() as folder:
        for each in trials(finished(Path(folder)), asked.bits, CUTS, asked.seed, asked.only):
            found.append(each)
            print(each.sort, each.what, dict(each.verdicts), *each.defects[:3], sep="\n", flush=True)
    show(table(found), Path(__file__).with_suffix(".csv") if asked.bits >= ALL_BITS and not asked.only else None)
    sys.exit(any(each.defects for each in found))


if __name__ == "__main__":
    main()
