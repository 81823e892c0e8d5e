"""Results on disk: whole or not there at all. The only writer of results.

What other tasks read (a compliance, a record that is driven) is a file of its own, `results/<key>.result`. Everything else stands
in logs, `results/*.log`, one of each process that computed: files grow with ranks and runs, not with tasks. Both hold entries
(nanoslip.study.results.entry), which say their key and are sealed: no bit of them can change, and no two files can change places,
without being found.
"""

import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from typing import Final, TypeVar

from nanoslip.solver.outcome import Outcome
from nanoslip.study.origin import Origins, here
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results import attempts
from nanoslip.study.results import entry as own
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import CorruptResultError, Head, Meta, OtherFormatError, packed
from nanoslip.study.results.file import clear_away, scratch_beside
from nanoslip.study.results.log import Logs, LogWriter, Places

FOLDER: Final = "results"
Said = TypeVar("Said")
_KEY: Final = re.compile("[0-9a-f]{20}")


class StoreError(Exception):
    """The folder of results cannot be used; the message says which and why."""


@contextmanager
def _refused() -> Iterator[None]:
    """Results of another format are no damage: the folder is not used."""
    try:
        yield
    except OtherFormatError as error:
        raise StoreError(str(error)) from None


class Store:
    """The results of a campaign in DIR/results. Two processes that write one result write the same bytes: no harm."""

    def __init__(self, out: Path, whole: bool = True) -> None:
        """whole: results count as finished when every byte is sound, else when what they say of themselves is."""
        self.folder = out / FOLDER
        self._out = out
        self._log = LogWriter(self.folder)
        self._logs = Logs(self.folder, whole)
        self._checked: dict[Path, tuple[object, Head]] = {}

    @_refused()
    def prepare(self) -> None:
        """Make the folder, try that it can be written and clear away what killed runs left. Raises StoreError."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            clear_away(self.folder)
            clear_away(self.folder.parent)  # the dataset is written there
            scratch_beside(self.folder / "probe").unlink()
            self._logs.mend()
            if problem := attempts.lost(self._out):
                sys.stderr.write(f"{problem}\n")
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write results there: {error.strerror or error}") from None

    def finished(self) -> set[str]:
        """Keys of all results that are there and sound; an unsound one is named on stderr and not counted."""
        return set(self.metas())

    def inventory(self) -> dict[str, Origins]:
        """The finished results, as `finished` counts them, and the software that each stems from."""
        return self._of_all(attrgetter("origins"))

    def outcomes(self) -> dict[str, Outcome]:
        """The finished results, as `finished` counts them, and how each ended."""
        return self._of_all(attrgetter("outcome"))

    def metas(self) -> Mapping[str, Meta]:
        """What every sound result says of itself. What has not changed since the last time is not checked again.

        Of millions of results nothing is copied: what is found later may be among them then.
        """
        self._look()
        return _Metas(self._logs.places, {key: head.meta for key, head in self._own_heads().items()})

    def _of_all(self, what: Callable[[Meta], Said]) -> dict[str, Said]:
        self._look()
        found = self._logs.places.of_all(what)
        found.update((key, what(head.meta)) for key, head in self._own_heads().items())
        return found

    def seals(self) -> Iterator[tuple[str, int]]:
        """The keys of the same, in order, and their seals: they change with what is in a result."""
        self._look()
        places, own = self._logs.places, self._own_heads()
        for key in sorted([*places, *(key for key in own if key not in places)]):
            yield key, own[key].seal if key in own else places.seal(key)

    @_refused()
    def _look(self) -> None:
        """Look for what has been added to logs. Raises StoreError."""
        self._logs.look()

    @_refused()
    def _own_heads(self) -> dict[str, Head]:
        """Of the results that are files of their own. Raises StoreError."""
        found = {}
        for path in sorted(self.folder.glob(f"*{own.ENDING}")):
            if not _KEY.fullmatch(path.stem):
                continue  # somebody else's
            try:
                stamp = own.stamp(path)
                if path not in self._checked or self._checked[path][0] != stamp:
                    self._checked[path] = stamp, own.checked(path)
                found[path.stem] = self._checked[path][1]
            except OtherFormatError:
                raise
            except CorruptResultError as error:
                _say_unsound(error)
            except FileNotFoundError:
                continue  # a run that goes on meanwhile has dropped it
        return found

    def failures(self) -> dict[str, Attempt]:
        """The last attempt of this solver at every task that has failed; it may have a result nevertheless."""
        return attempts.final(self._out, here().solver)

    def write(self, result: TaskResult, shared: bool = False) -> None:
        """Keep a result; shared: in a file of its own, as other tasks read it. Raises StoreError where the disk refuses."""
        entry = packed(result)
        try:
            if shared:
                own.write(own.path_of(self.folder, result.key), entry)
                return
            self._log.add(entry)
            self._logs.places.forget(result.key)  # to be found anew
            file = f"{self.folder}/{result.key}{own.ENDING}"  # a path would take longer than the look
            if os.path.isfile(file):
                Path(file).unlink(missing_ok=True)  # it would count more
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write {result.key}: {error.strerror or error}") from error

    def read(self, key: str) -> TaskResult:
        """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
        if os.path.lexists(f"{self.folder}/{key}{own.ENDING}"):  # a path would take longer than the look
            try:
                return own.read(own.path_of(self.folder, key))
            except CorruptResultError:
                if not self._logs.find(key):
                    raise
        if place := self._logs.find(key):
            return self._logs.read(place)
        raise FileNotFoundError(f"{self.folder}: no result {key}")

    def find(self, key: str) -> TaskResult | None:
        """A result as `read` gives it; None where there is none, or an unsound one, which is named on stderr."""
        try:
            return self.read(key)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except CorruptResultError as error:
            _say_unsound(error)
            return None

    def settle(self) -> None:
        """Have all results outlast a loss of power. Raises StoreError where the disk refuses."""
        try:
            self._logs.settle()
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot keep results: {error.strerror or error}") from error

    def close(self) -> None:
        """Write out what this process has added: other machines see it then. Raises StoreError where the disk refuses."""
        try:
            self._log.close()
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot keep results: {error.strerror or error}") from error

    def drop(self, key: str) -> None:
        """Remove a result that other tasks have read and nothing needs any more. Raises StoreError."""
        path = own.path_of(self.folder, key)
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{path}: cannot be removed: {error.strerror or error}") from error

    def outdated(self) -> list[Path]:
        """Results of an older nanoslip, which kept each in files of its own: this one does not read them."""
        files = self.folder.glob("*.np[yz]")
        return sorted(path for path in files if _KEY.fullmatch(path.stem))


class _Metas(Mapping[str, Meta]):
    """Key -> what its result says of itself: in a file of its own, else in a log."""

    def __init__(self, places: Places, own: Mapping[str, Meta]) -> None:
        self._places, self._own = places, own

    def __getitem__(self, key: str) -> Meta:
        return self._own[key] if key in self._own else self._places.meta(key)

    def __contains__(self, key: object) -> bool:
        return key in self._own or key in self._places

    def __iter__(self) -> Iterator[str]:
        return itertools.chain(self._own, (key for key in self._places if key not in self._own))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _say_unsound(error: CorruptResultError) -> None:
    sys.stderr.write(f"{error}; it will be computed again\n")
