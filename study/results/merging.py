"""What shards have finished, moved into the campaign's own results. What they have not is left there to be done."""

import os
from contextlib import suppress
from pathlib import Path

from nanoslip.study.results import attempts
from nanoslip.study.results import attempts as runs
from nanoslip.study.results import entry as own
from nanoslip.study.results import file as lines
from nanoslip.study.results.file import free_name
from nanoslip.study.results.lease import Lease
from nanoslip.study.results.log import is_name, later
from nanoslip.study.results.shard import FOLDER, folders
from nanoslip.study.results.store import FOLDER as RESULTS
from nanoslip.study.results.store import Store, StoreError


def merge_shards(out: Path) -> list[str]:
    """Move results, attempts and journals of all shards; returns why some could not be: a run is at work there, for example.

    Whoever calls this has the lease of the campaign's folder, and has prepared its store.
    """
    left = []
    for folder in folders(out):
        try:
            with Lease(folder):
                _move(folder, out)
        except StoreError as error:
            left.append(str(error))
        except OSError as error:
            left.append(f"{folder}: cannot be merged: {error.strerror or error}")
        with suppress(OSError):  # not empty
            folder.rmdir()
    with suppress(OSError):
        (out / FOLDER).rmdir()
    return left


def _move(shard: Path, out: Path) -> None:
    store = Store(shard)
    store.prepare()  # mends what a killed run left
    for path in sorted(store.folder.iterdir()):
        os.replace(path, _place(path, out / RESULTS))
    for name in (attempts.FILE, runs.RUNS_FILE):
        path = shard / name
        if path.is_file():
            lines.add(out / name, path.read_bytes().rstrip(b"\n") + b"\n")
            path.unlink()
    store.folder.rmdir()


def _place(path: Path, results: Path) -> Path:
    """Where a file comes to: results of a shard count more than what was there, all else takes no place of another."""
    if is_name(path.name):
        return later(results, path.name)
    place = results / path.name
    return free_name(place) if path.suffix != own.ENDING and os.path.lexists(place) else place
