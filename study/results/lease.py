"""One run at a time in a folder: two would compute everything twice, and the first would drop what the second still reads.

Whoever runs keeps a file fresh that says who it is. It is stale when its process has ended, or when nobody has touched it for
a minute, by the clock of the file system that holds it: the run was killed, on whatever host. One that was only suspended
finds its lease with another run when it wakes, or gone with the end of that run, and stops.

No lock is needed. A lease appears by a hard link to a complete file, which one run alone can make. The heir of a stale lease is
such a link too, under a name that belongs to that lease alone, and is renamed into its place. Files are opened to be looked at:
network file systems remember times and contents for a minute, but not of what is opened anew.
"""

import hashlib
import json
import os
import secrets
import socket
import stat
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

from nanoslip.study.results.file import lives, scratch_beside
from nanoslip.study.results.store import StoreError

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
    """When (ns)."""

    @property
    def heir(self) -> Path:
        """The name of the run that takes it over: as no two leases have the same text, of this one alone."""
        return self.path.with_name(f".{FILE}.heir-{hashlib.sha256(self.text).hexdigest()[:16]}")


class Lease:
    """While entered, no other run may use the folder."""

    def __init__(self, out: Path, stop: Callable[[], object] = lambda: None) -> None:
        """stop: called once, should another run take over: this one was silent for so long that it seemed to have ended."""
        self._path = out / FILE
        started = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime())
        owner = {"host": socket.gethostname(), "process": os.getpid(), "started": started, "machine": _machine()}
        self._text = json.dumps({**owner, "name": secrets.token_hex(8)}).encode("ascii")
        self._stop = stop
        self.lost = ""
        """Why this run has to stop; empty while it has the lease."""
        self._over = threading.Event()
        self._looking = threading.Lock()
        self._beat = threading.Thread(target=self._keep_fresh, name="lease", daemon=True)

    def __enter__(self) -> Self:
        """Raises StoreError where another run is at work there, or the folder refuses."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            scratch = scratch_beside(self._path)
            try:
                scratch.write_bytes(self._text)
                while not self._taken(scratch):
                    pass  # another run was quicker
            finally:
                scratch.unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{self._path}: cannot be written: {error.strerror or error}") from None
        self._beat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._beat.join()
        with suppress(OSError, StoreError):
            if self._is_ours(self._path):
                self._path.unlink()

    def look(self) -> str:
        """Touch the lease where this run has it; else say why not, once, and have the run stop. Returns `lost`."""
        with self._looking:
            if not self.lost:
                self._touch()
        return self.lost

    def _taken(self, scratch: Path) -> bool:
        """Put our file there where nothing is, or in the place of what is stale; whether that was done. Raises StoreError."""
        line = self._line()
        if not line:
            return self._linked(scratch, self._path)
        last = line[-1]
        if not _ended(last, scratch):
            raise StoreError(_BUSY.format(path=last.path, **_words(_owner(last))))
        if not self._linked(scratch, last.heir):
            return False
        now = self._line()
        if not now or now[-1].text != self._text:  # meanwhile another run has taken it over
            last.heir.unlink(missing_ok=True)
            return False
        os.replace(last.heir, self._path)
        for each in line[1:]:
            each.path.unlink(missing_ok=True)
        return True

    def _line(self) -> list[_Found]:
        """The lease that is there, and behind it its heirs that were killed before they were in its place."""
        found, place = [], _opened(self._path)
        while place:
            found.append(place)
            place = _opened(place.heir)
        return found

    def _linked(self, scratch: Path, path: Path) -> bool:
        """Whether our file has this name now; an answer that the network has lost says the opposite of what is."""
        with suppress(FileExistsError):
            os.link(scratch, path)
        return self._is_ours(path)

    def _is_ours(self, path: Path) -> bool:
        found = _opened(path)
        return found is not None and found.text == self._text

    def _keep_fresh(self) -> None:
        while not (self._over.wait(BEAT) or self.look()):
            pass

    def _touch(self) -> None:
        try:
            found = _opened(self._path)
            if found and found.text == self._text:
                os.utime(self._path)
                return
        except FileNotFoundError:
            found = None  # just now
        except (OSError, StoreError):
            return  # nobody can say; the next look may
        self.lost = _LOST.format(path=self._path, **_words(_owner(found))) if found else _GONE.format(path=self._path)
        sys.stderr.write(f"{self.lost}\n")
        self._stop()


def _opened(path: Path) -> _Found | None:
    """What stands there; None where nothing does. Raises OSError, StoreError where it is a folder."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    except OSError:
        if not stat.S_ISREG(path.lstat().st_mode):  # a link, a socket
            return _Found(path, b"", 0)
        raise
    try:
        state = os.fstat(file)
        if stat.S_ISDIR(state.st_mode):
            raise StoreError(f"{path}: a folder, where a run says who it is; remove it")
        regular = stat.S_ISREG(state.st_mode)
        return _Found(path, os.read(file, _MOST) if regular else b"", state.st_mtime_ns if regular else 0)
    finally:
        os.close(file)


def _ended(found: _Found, clock: Path) -> bool:
    """Whether the run that holds a lease has ended; waits until that is known. clock: a file of ours, for its times."""
    owner = _owner(found)
    here = owner.get("host") == socket.gethostname() and owner.get("machine") == _machine()
    if here and not lives(owner["process"]):
        return True
    age, patience = _age(found, clock), time.monotonic() + FRESH  # whatever times the file claims
    if here and age < 2.0 * BEAT:
        return False
    said = False
    while age < FRESH and time.monotonic() < patience:
        if not said and age > 2.0 * BEAT:
            said = True
            sys.stderr.write(_WAITING.format(path=found.path, seconds=FRESH - age, **_words(owner)))
        time.sleep(BEAT / 5.0)
        again = _opened(found.path)
        if again is None or again.text != found.text:
            return True  # whoever has it now is another one
        if again.touched != found.touched:
            return False
        age = _age(found, clock)
    return True


def _age(found: _Found, clock: Path) -> float:
    """Seconds since a lease was touched, by the clock of its file system."""
    file = os.open(clock, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        os.utime(file)
        return (os.fstat(file).st_mtime_ns - found.touched) / 1e9
    finally:
        os.close(file)


def _owner(found: _Found) -> dict[str, Any]:
    """What a lease says; empty where no run has written it."""
    with suppress(ValueError, RecursionError):
        said = json.loads(found.text)
        if isinstance(said, dict) and isinstance(said.get("process"), int) and said["process"] > 0:
            return said
    return {}


def _machine() -> str:
    """What tells machines of one name apart, and containers in them: their processes have other numbers."""
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        return f"{boot} {os.readlink('/proc/self/ns/pid')}"
    return ""


def _words(owner: dict[str, Any]) -> dict[str, str]:
    """Who it is, as far as the file says; never more of a foreign file than a word each."""
    return {name: str(owner.get(name, "unknown"))[:40] for name in ("host", "process", "started")}


_WHO: Final = "process {process} on {host}, since {started}"
_BUSY: Final = f"{{path}}: a run is at work there, {_WHO}; wait until it has ended, or use another --out"
_WAITING: Final = f"{{path}}: a run was at work there, {_WHO}; it is silent, and counts as ended in {{seconds:.0f}} s\n"
_LOST: Final = f"{{path}}: another run has taken over, {_WHO}, while this one was silent: this one stops"
_GONE: Final = (
    "{path}: gone: another run has taken over while this one was silent, and ended, or somebody has removed it: "
    "this one stops; run again to continue"
)
