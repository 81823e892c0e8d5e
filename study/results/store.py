"""Results on disk: one file per finished task, whole or not there at all. The only writer of results.

`results/<key>.npz` holds a result's arrays and, as JSON, its outcome and scalars. A compliance is `<key>.npy`, which
readers map into memory so that the ranks of a node hold one copy, and a `<key>.json` with its checksum. Both say their key and
are sealed: no bit of a file can change, and no two files can change places, without being found.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from solver.outcome import Ending, Outcome
from study.origin import Origins, as_data, from_data, here
from study.plan.tasks import TaskResult
from study.results import attempts, sealed
from study.results.attempts import Attempt
from study.results.sealed import KEY, MAPPED, CorruptResultError
from study.results.whole_file import clear_away, written_whole

FOLDER: Final = "results"
_ORIGINS: Final = "origins"


class StoreError(Exception):
    """The folder of results cannot be used; the message says which and why."""


class Store:
    """The results of a campaign in DIR/results. Two processes that write one result write the same bytes: no harm."""

    def __init__(self, out: Path) -> None:
        self.folder = out / FOLDER
        self._out = out
        self._checked: dict[Path, tuple[object, dict[str, Any]]] = {}

    def prepare(self) -> None:
        """Make the folder, try that it can be written and clear away what killed runs left. Raises StoreError."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            clear_away(self.folder)
            clear_away(self.folder.parent)  # the dataset is written there
            with written_whole(self.folder / ".probe") as scratch:
                scratch.touch()
            (self.folder / ".probe").unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write results there: {error.strerror or error}") from None

    def finished(self) -> set[str]:
        """Keys of all results that are there and sound; an unsound file is named on stderr and not counted."""
        return set(self.inventory())

    def inventory(self) -> dict[str, Origins]:
        """The finished results, as `finished` counts them, and the software that each stems from."""
        return {key: from_data(meta.get(_ORIGINS, ())) for key, meta in self._sound()}

    def outcomes(self) -> dict[str, Outcome]:
        """The finished results, as `finished` counts them, and how each ended."""
        return {key: Outcome(Ending(meta["ending"]), meta["message"]) for key, meta in self._sound()}

    def failures(self) -> dict[str, Attempt]:
        """The last attempt of this solver at every task that has failed; it may have a result nevertheless."""
        return attempts.final(self._out, here().solver)

    def write(self, result: TaskResult) -> None:
        """Keep a result. Raises StoreError where the disk refuses."""
        meta = {
            KEY: result.key,
            "kind": result.kind,
            "ending": result.outcome.ending.value,
            "message": result.outcome.message,
            "scalars": dict(result.scalars),
            _ORIGINS: as_data(result.origins),
        }
        try:
            if MAPPED in result.arrays:
                self._write_mapped(result, meta)
            else:
                with written_whole(self.folder / f"{result.key}.npz") as scratch:
                    scratch.write_bytes(sealed.archived(meta, result.arrays))
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write {result.key}: {error.strerror or error}") from error

    def read(self, key: str) -> TaskResult:
        """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
        meta, arrays = sealed.read(self.folder, key)
        outcome = Outcome(Ending(meta["ending"]), meta["message"])
        origins = from_data(meta.get(_ORIGINS, ()))
        return TaskResult(key, meta["kind"], outcome, meta["scalars"], arrays, origins)

    def find(self, key: str) -> TaskResult | None:
        """A result as `read` gives it; None where there is none, or an unsound one, which is named on stderr."""
        try:
            return self.read(key)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except CorruptResultError as error:
            _say_unsound(error)
            return None

    def drop(self, key: str) -> None:
        """Remove a result that nothing needs any more. Raises StoreError."""
        path = self.folder / f"{key}.npz"
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{path}: cannot be removed: {error.strerror or error}") from error

    def _sound(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Key and meta data of every sound result. A file that has not changed since the last time is not checked again."""
        for path in sorted(self.folder.glob("*.npz")) + sorted(self.folder.glob("*.json")):
            try:
                stamp = sealed.stamp(path)
                if path not in self._checked or self._checked[path][0] != stamp:
                    self._checked[path] = stamp, sealed.checked(path)
                yield path.stem, self._checked[path][1]
            except CorruptResultError as error:
                _say_unsound(error)
            except FileNotFoundError:
                continue  # a run that goes on meanwhile has dropped it

    def _write_mapped(self, result: TaskResult, meta: dict[str, Any]) -> None:
        matrix = self.folder / f"{result.key}.npy"
        with written_whole(matrix) as scratch:
            with scratch.open("wb") as file:
                np.save(file, result.arrays[MAPPED], allow_pickle=False)
            said = sealed.described(meta, scratch.read_bytes())
        with written_whole(matrix.with_suffix(".json")) as scratch:
            scratch.write_bytes(said)


def _say_unsound(error: CorruptResultError) -> None:
    sys.stderr.write(f"{error}; it will be computed again\n")
