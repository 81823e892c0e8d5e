"""What a run makes of a damaged folder: it goes on in this process, with known results in the place of computed ones."""

import io
import signal
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from enum import StrEnum
from pathlib import Path
from types import FrameType
from typing import Final
from unittest.mock import patch

from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.dataset import file
from nanoslip.study.results import attempts, log
from nanoslip.study.results import attempts as runs
from nanoslip.study.results import store as lease
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import packed
from nanoslip.study.results.log import Fault
from nanoslip.study.results.store import Lease, Store, StoreError
from nanoslip.study.run.executor import left
from tests.study.results.fuzz.finished import Finished, seals

PATIENCE: Final = 5
"""Seconds after which a look at a folder is taken to block; each takes some milliseconds."""


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
    named = any(
        path.name in said.getvalue() for path in finished.files.values()
    )  # two that changed places, for example
    if found is Verdict.SILENT and named:
        return Verdict.NAMED, ""
    return found, said.getvalue()


def _look(finished: Finished, out: Path, damaged: Path, thorough: bool) -> Verdict:
    refused = _read_dataset(finished, out) if damaged.name == file.FILE else False
    gone = _is_whole(out, damaged)
    with Lease(out):
        store = Store(out)
        store.prepare()
        inventory, failures = store.inventory(), store.failures()
        if any(packed(store.read(key)) != packed(finished.results[key]) for key in inventory):
            raise OtherNumbersError("a result that nobody has computed")
        runs.read(out)
        tasks = left(finished.plan, failures, inventory).tasks
        for task in tasks:
            if task.key in finished.results:
                store.write(finished.results[task.key], task.shared)
            else:
                attempts.add(out, finished.failed)
        _look_again(finished, out, thorough and attempts.final(out, finished.failed.solver) == _failures(finished))
    if tasks:
        return Verdict.GONE if gone else Verdict.SILENT
    if refused:
        return Verdict.REFUSED
    return Verdict.HARMLESS if failures == _failures(finished) else Verdict.WORDS


def _look_again(finished: Finished, out: Path, thorough: bool) -> None:
    """All is there again, and where the whole dataset is wanted, that has the same bytes."""
    if seals(out) != seals(finished.out):
        raise OtherNumbersError("results that are not those of before")
    if thorough:
        write_dataset(finished.plan, Store(out))
        if (out / file.FILE).read_bytes() != (finished.out / file.FILE).read_bytes():
            raise OtherNumbersError("another dataset")


def _failures(finished: Finished) -> dict[str, Attempt]:
    return {finished.failed.task: finished.failed}


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
    return (
        path.suffix == log.ENDING and path.is_file() and not any(isinstance(found, Fault) for found in log.scan(path))
    )


@contextmanager
def _patience() -> Iterator[None]:
    def block(_: int, __: FrameType | None) -> None:
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
