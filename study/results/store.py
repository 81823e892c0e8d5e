"""Results on disk: whole or not there at all. The only writer of results; the lease of a folder; shards merged.

Results that other tasks read are files, `results/<key>.result`; all others are in logs, `results/*.log`, one of each process.
Entries (nanoslip.study.results.entry) hold their key and a seal: a changed bit or an exchanged file is found.
"""

import hashlib
import json
import os
import re
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

from nanoslip.solver.outcome import LONGEST_MESSAGE, NanoslipError, Outcome, printable
from nanoslip.study.notices import print_notice
from nanoslip.study.origin import Origins, here
from nanoslip.study.results import attempts, entry, files
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import CorruptResultError, Head, Logs, LogWriter, Meta, ResultFormatError
from nanoslip.study.results.files import is_no_file, make_scratch, open_regular
from nanoslip.study.tasks.task import TaskResult

FOLDER: Final = "results"
_KEY: Final = re.compile("[0-9a-f]{20}")


class StoreError(NanoslipError):
    """Error of a results folder that cannot be used; the message has file and reason."""


@contextmanager
def _refusing_formats() -> Iterator[None]:
    """Results of another format are no damage: the folder is not used."""
    try:
        yield
    except ResultFormatError as error:
        raise StoreError(str(error)) from None


@contextmanager
def failing(what: object) -> Iterator[None]:
    """Turn errors of the disk into a StoreError that names the failed action and the reason."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{what}: {error.strerror or error}") from error


class Store:
    """Results of a campaign in DIR/results. Two processes that write the same result write the same bytes, which does
    no harm."""

    def __init__(self, out: Path, whole: bool = True) -> None:
        """whole: check every byte of a result, else only its head."""
        self.folder = out / FOLDER
        self._out = out
        # Damage is met again and again, and named once.
        self._notice = lru_cache(None)(print_notice)
        self._log = LogWriter(self.folder)
        self._logs = Logs(self.folder, whole, self._notice)
        self._checked: dict[Path, tuple[object, Head]] = {}

    @_refusing_formats()
    def prepare(self) -> None:
        """Create the folder, test writing, and remove scratch files of killed runs. Raises StoreError."""
        if os.fsencode(self._out).decode("utf-8", "ignore") != str(self._out):
            shown = printable(str(self._out), LONGEST_MESSAGE)
            raise StoreError(f"{shown}: needs a name in UTF-8, as netCDF files have")
        try_writing(self.folder)
        with failing(f"{self.folder}: cannot write results there"):
            files.clear_away(self.folder)
            # The dataset is written into that folder, beside the results.
            files.clear_away(self.folder.parent)
            self._logs.mend()
            if lost := attempts.lost(self._out):
                self._notice(lost)

    def finished(self) -> set[str]:
        """Keys of all results that are there and sound; an unsound one is named on stderr and not counted."""
        return set(self.metas())

    def inventory(self) -> dict[str, Origins]:
        """The finished results, as `finished` counts them, and the software that each stems from."""
        return {key: meta.origins for key, meta in self.metas().items()}

    def outcomes(self) -> dict[str, Outcome]:
        """The finished results, as `finished` counts them, and how each ended."""
        return {key: meta.outcome for key, meta in self.metas().items()}

    def metas(self) -> dict[str, Meta]:
        """Heads of all sound results; unchanged files are not checked again."""
        return {key: head.meta for key, head in self._heads().items()}

    def seals(self) -> list[tuple[str, int]]:
        """Their keys, in order, and checksums."""
        return sorted((key, head.seal) for key, head in self._heads().items())

    @_refusing_formats()
    def _heads(self) -> dict[str, Head]:
        """Heads of all sound results; a separate file takes precedence over a log. Raises StoreError."""
        self._logs.look()
        logged = {key: place.head for key, place in self._logs.places.items()}
        return {**logged, **self._own_heads()}

    def _own_heads(self) -> dict[str, Head]:
        """Heads of the results that are files of their own. Raises ResultFormatError."""
        heads = {}
        for path in files.matching(self.folder, f"*{entry.ENDING}"):
            if not _KEY.fullmatch(path.stem):
                # A file of another program.
                continue
            try:
                state = path.lstat()
                stamp = state.st_mtime_ns, state.st_size, state.st_ino
                if path not in self._checked or self._checked[path][0] != stamp:
                    head = entry.check_file(path)
                    # Read, too: with right checksums the content may still be of no use to this
                    # version.
                    entry.read_entry(path)
                    self._checked[path] = stamp, head
                head = self._checked[path][1]
                if not self._logs.is_rejected(head):
                    heads[path.stem] = head
            except ResultFormatError:
                raise
            except CorruptResultError as error:
                self._notice(f"{error}{entry.AGAIN}")
            except FileNotFoundError:
                # A run that goes on meanwhile has dropped the result.
                continue
        return heads

    def failures(self) -> dict[str, Attempt]:
        """The last attempt of this solver at every task that has failed; it may have a result nevertheless."""
        return attempts.final(self._out, here().solver)

    def write(self, result: TaskResult, shared: bool = False) -> None:
        """Keep a result; shared: in a separate file, as other tasks read it. Raises StoreError if the disk
        refuses."""
        content = entry.pack_result(result)
        with failing(f"{self.folder}: cannot write {result.key}"):
            if shared:
                path = entry.result_path(self.folder, result.key)
                self._logs.set_aside_unusable(path)
                files.write_whole(path, [content])
                return
            self._log.add(content)
            # The place in the log is that of an older result.
            self._logs.places.pop(result.key, None)
            # A `Path` would take longer to make than the file to look for.
            file = f"{self.folder}/{result.key}{entry.ENDING}"
            if os.path.isfile(file):
                # The file is older than the log, and would be read first.
                Path(file).unlink(missing_ok=True)

    def reject(self, key: str) -> None:
        """Have a result count as not finished: this version cannot use it, though its checksums are right."""
        with suppress(FileNotFoundError, CorruptResultError):
            path = entry.result_path(self.folder, key)
            self._logs.reject(entry.check_file(path))
        if place := self._logs.find(key):
            self._logs.reject(place.head)

    def read(self, key: str) -> TaskResult:
        """A result; its arrays are read-only. Raises CorruptResultError, FileNotFoundError."""
        # A `Path` would take longer to make than the file to look for.
        if os.path.lexists(f"{self.folder}/{key}{entry.ENDING}"):
            try:
                return entry.read_entry(entry.result_path(self.folder, key))
            except CorruptResultError:
                if not self._logs.find(key):
                    raise
        if place := self._logs.find(key):
            return self._logs.read(place)
        raise FileNotFoundError(f"{self.folder}: no result {key}")

    def find(self, key: str) -> TaskResult | None:
        """A result as `read` gives it; None if there is none, or an unsound one, which is named on stderr."""
        try:
            return self.read(key)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except CorruptResultError as error:
            self._notice(f"{error}{entry.AGAIN}")
            return None

    def settle(self) -> None:
        """Have all results outlast a loss of power. Raises StoreError if the disk refuses."""
        with failing(f"{self.folder}: cannot keep results"):
            self._logs.settle()

    def close(self) -> None:
        """Sync results of this process, so that other machines see them. Raises StoreError."""
        with failing(f"{self.folder}: cannot keep results"):
            self._log.close()

    def drop(self, key: str) -> None:
        """Remove a result that other tasks have read and nothing needs any more. Raises StoreError."""
        path = entry.result_path(self.folder, key)
        with failing(f"{path}: cannot be removed"):
            path.unlink(missing_ok=True)


# One run at a time in a folder: two would compute everything twice, and the first would drop what the second still reads.
#
# A run holds a lease: a file with its name, touched again and again. It is stale when its process has ended, or untouched for
# a minute by the clock of its file system (the run was killed). A suspended run stops when it wakes and another has the lease.
#
# No lock is needed. A lease appears by a hard link to a complete file, which only one run can make; without hard links by a
# file that only one can create, empty for a moment. To take over a stale lease, a run links its own file under a name derived
# from that lease, then renames it over the lease. Files are opened before they are examined: network file systems cache times
# and contents for a minute, but not of newly opened files.

FILE: Final = "running.json"
FRESH: Final = 60.0
"""Seconds without a touch after which a lease is stale."""
BEAT: Final = 5.0
"""Seconds between touches."""
_MOST: Final = 1000
"""Bytes that are read of a lease: each has fewer."""


class _Found(NamedTuple):
    """A lease as it was when it was opened; no text where no regular file stands there."""

    path: Path
    text: bytes
    touched: int
    """Time of the last touch, in ns."""

    @property
    def heir(self) -> Path:
        """Name of the file of the run that takes over: unique, as no two leases have the same text."""
        return self.path.with_name(f".{FILE}.heir-{hashlib.sha256(self.text).hexdigest()[:16]}")


class Lease:
    """While entered, no other run may use the folder."""

    def __init__(self, out: Path, stop: Callable[[], object] = lambda: None) -> None:
        """stop: called once if another run takes over, as this one was silent for too long."""
        self._path = out / FILE
        started = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime())
        owner = {"host": socket.gethostname(), "process": os.getpid(), "started": started, "machine": _machine()}
        content = {**owner, "name": secrets.token_hex(8)}
        self._text = json.dumps(content).encode("ascii")
        self._stop = stop
        self.lost = ""
        """Reason why this run has to stop; empty while it has the lease."""
        self._over = threading.Event()
        # Two threads look: the run, and the one that keeps the lease fresh.
        self._looking = threading.Lock()
        self._beat = threading.Thread(target=self._keep_fresh, name="lease", daemon=True)

    def __enter__(self) -> Self:
        """Raises StoreError if another run is at work there, or the folder refuses."""
        with failing(f"{self._path}: cannot be written"):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            # Complete before it gets the lease's name: no run ever reads half a lease.
            scratch = make_scratch(self._path, self._text)
            try:
                while not self._take(scratch):
                    # Another run was quicker.
                    pass
            finally:
                scratch.unlink(missing_ok=True)
        self._beat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._beat.join()
        with suppress(OSError, StoreError):
            # A run that has taken over keeps its lease.
            if self._is_ours(self._path):
                self._path.unlink()

    def look(self) -> str:
        """Touch the lease if this run has it; else report the reason once and stop the run. Returns `lost`."""
        with self._looking:
            if not self.lost:
                self._touch()
        return self.lost

    def _take(self, scratch: Path) -> bool:
        """Create the lock file or replace a stale lock file; returns True on success. Raises StoreError."""
        line = self._line()
        if not line:
            return self._has_link(scratch, self._path)
        last = line[-1]
        if not _has_ended(last, scratch):
            words = _words(_owner(last))
            raise StoreError(_BUSY.format(path=last.path, **words))
        if not self._has_link(scratch, last.heir):
            return False
        now = self._line()
        # Meanwhile another run has taken the lease over.
        if not now or now[-1].text != self._text:
            last.heir.unlink(missing_ok=True)
            return False
        os.replace(last.heir, self._path)
        for later in line[1:]:
            later.path.unlink(missing_ok=True)
        return True

    def _line(self) -> list[_Found]:
        """Existing lease, followed by the leases of runs that were killed while taking over."""
        leases, place = [], _read_lease(self._path)
        while place:
            leases.append(place)
            place = _read_lease(place.heir)
        return leases

    def _has_link(self, scratch: Path, path: Path) -> bool:
        """True if our file now has this name; after a lost reply of the network the reported error may be wrong."""
        with suppress(FileExistsError):
            try:
                os.link(scratch, path)
            except FileExistsError:
                raise
            except OSError as error:
                # A run that is killed meanwhile leaves a lease of nobody, stale in a minute.
                files.create(path, self._text)
                why = error.strerror or error
                print_notice(_NO_LINKS.format(folder=path.parent, why=why))
        return self._is_ours(path)

    def _is_ours(self, path: Path) -> bool:
        lease = _read_lease(path)
        return lease is not None and lease.text == self._text

    def _keep_fresh(self) -> None:
        while not (self._over.wait(BEAT) or self.look()):
            pass

    def _touch(self) -> None:
        try:
            lease = _read_lease(self._path)
            if lease and lease.text == self._text:
                os.utime(self._path, follow_symlinks=False)
                return
        except FileNotFoundError:
            # The file was removed just now.
            lease = None
        except (OSError, StoreError):
            # No answer from the file system; the next look may have one.
            return
        if lease:
            words = _words(_owner(lease))
            self.lost = _LOST.format(path=self._path, **words)
        else:
            self.lost = _GONE.format(path=self._path)
        print_notice(self.lost)
        self._stop()


def _read_lease(path: Path) -> _Found | None:
    """Contents of a file; None without one. Raises OSError, StoreError for a folder."""
    try:
        with os.fdopen(open_regular(path), "rb") as file:
            text = file.read(_MOST)
            return _Found(path, text, os.fstat(file.fileno()).st_mtime_ns)
    except FileNotFoundError:
        return None
    except OSError:
        if path.is_dir() and not path.is_symlink():
            raise StoreError(f"{path}: a folder, where a run says who it is; remove it") from None
        if is_no_file(path):
            return _Found(path, b"", 0)
        raise


def _has_ended(lease: _Found, clock: Path) -> bool:
    """True if the run that holds a lease has ended; waits until this is certain. clock: a file that dates by the server's
    time."""
    owner = _owner(lease)
    same_host = owner.get("host") == socket.gethostname()
    here = same_host and owner.get("machine") == _machine()
    if here and not files.lives(owner["process"]):
        return True
    # By this machine's own clock, whatever times the file claims.
    age, patience = _age(lease, clock), time.monotonic() + FRESH
    # An older lease may be of a killed run, whose process number another process has got since.
    if here and age < 2.0 * BEAT:
        return False
    said = False
    while age < FRESH and time.monotonic() < patience:
        if not said and age > 2.0 * BEAT:
            said = True
            words, left = _words(owner), FRESH - age
            print_notice(_WAITING.format(path=lease.path, seconds=left, **words))
        time.sleep(BEAT / 5.0)
        again = _read_lease(lease.path)
        if again is None or again.text != lease.text:
            # Whoever has the lease now is another run.
            return True
        if again.touched != lease.touched:
            return False
        age = _age(lease, clock)
    return True


def _age(lease: _Found, clock: Path) -> float:
    """Seconds since a lease was touched, by the clock of its file system."""
    with os.fdopen(open_regular(clock), "rb") as file:
        # Dated by the server that dates the lease, whatever this machine's clock says.
        os.utime(file.fileno())
        now = os.fstat(file.fileno()).st_mtime_ns
        return (now - lease.touched) / 1e9


def _owner(lease: _Found) -> dict[str, Any]:
    """Contents of a lease; empty unless written by a run."""
    with suppress(ValueError, RecursionError):
        said = json.loads(lease.text)
        if isinstance(said, dict) and isinstance(said.get("process"), int) and said["process"] > 0:
            return said
    return {}


def _machine() -> str:
    """Identity of a machine or container beyond its name: process numbers differ between them."""
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        return f"{boot} {os.readlink('/proc/self/ns/pid')}"
    return ""


def _words(owner: dict[str, Any]) -> dict[str, str]:
    """Owner of a lease by its file; at most a word for each field of a foreign file."""
    return {name: str(owner.get(name, "unknown"))[:40] for name in ("host", "process", "started")}


_NO_LINKS: Final = (
    "{folder}: its file system has no hard links ({why}): the run is noted there by a file that only one run can create"
)
_WHO: Final = "process {process} on {host}, since {started}"
_BUSY: Final = f"{{path}}: a run is at work there, {_WHO}; wait until it has ended, or use another --out"
_WAITING: Final = f"{{path}}: a run was at work there, {_WHO}; it is silent, and counts as ended in {{seconds:.0f}} s"
_LOST: Final = f"{{path}}: another run has taken over, {_WHO}, while this one was silent: this one stops"
_GONE: Final = (
    "{path}: lock file missing (taken over by a run that has ended, or deleted): this run stops; run again to continue"
)


# Finished results of shards, moved into the campaign's own. Unfinished tasks are left there to be done.


def merge_shards(out: Path) -> list[str]:
    """Move results, attempts and journals of all shards; returns why some could not be: a run is at work there, for example.

    Whoever calls this has the lease of the campaign's folder, and has prepared its store.
    """
    problems = []
    for folder in files.shard_folders(out):
        try:
            # All files that a link leads to would be moved.
            if folder.is_symlink() or (folder / FOLDER).is_symlink():
                raise StoreError(f"{folder}: a link leads out of it: not merged")
            with Lease(folder):
                _move(folder, out)
        except StoreError as error:
            problems.append(str(error))
        except OSError as error:
            problems.append(f"{folder}: cannot be merged: {error.strerror or error}")
        # A folder that is not empty stays.
        with suppress(OSError):
            folder.rmdir()
    with suppress(OSError):
        (out / files.SHARDS).rmdir()
    return problems


def _move(shard: Path, out: Path) -> None:
    store = Store(shard)
    # It mends what a killed run left.
    store.prepare()
    # In the order of the logs, so that of two results the later one still counts.
    for path in sorted(store.folder.iterdir()):
        os.replace(path, _place(path, out / FOLDER))
    for name in (attempts.FILE, attempts.RUNS_FILE):
        path = shard / name
        with suppress(FileNotFoundError):
            lines = files.read_bytes(path).rstrip(b"\n")
            files.append_lines(out / name, lines + b"\n")
            path.unlink()
    store.folder.rmdir()


def _place(path: Path, results: Path) -> Path:
    """Choose the target of an imported file: results of a shard replace existing ones, other files replace none."""
    if entry.is_name(path.name):
        return entry.later(results, path.name)
    place = results / path.name
    is_result = path.suffix == entry.ENDING
    if is_result or not os.path.lexists(place):
        return place
    return files.free_name(place)


def try_writing(folder: Path) -> None:
    """Create a folder and a file in it, to find failures before results are computed. Raises StoreError."""
    with failing(f"{folder}: cannot write results there"):
        folder.mkdir(parents=True, exist_ok=True)
        make_scratch(folder / "probe").unlink()


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write files with their contents, and the folders that they are in. Raises StoreError."""
    for path, content in contents.items():
        with failing(f"{path}: cannot be written"):
            path.parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(path, [content])
