"""One run at a time in a folder: two would compute everything twice, and the first would drop what the second still reads.

Whoever runs keeps a file fresh that says who it is. It is stale when its process has ended, or when nobody has touched it for
a minute, by the clock of the file system that holds it: the run was killed, on whatever host. One that was only suspended
finds its lease with another run when it wakes, and stops.
"""

import fcntl
import json
import math
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final, Self

from study.results.store import StoreError
from study.results.whole_file import lives

FILE: Final = "running.json"
FRESH: Final = 60.0
"""Seconds without a touch after which a lease is stale."""
BEAT: Final = 5.0
"""Seconds between touches."""

_Identity = tuple[int, int, int]
"""Device, number and time of the last change (ns) of what stands in the place of a lease."""


class Lease:
    """While entered, no other run may use the folder."""

    def __init__(self, out: Path, stop: Callable[[], object] = lambda: None) -> None:
        """stop: called once, should another run take over: this one was silent for so long that it seemed to have ended."""
        self._path = out / FILE
        started = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime())
        owner = {"host": socket.gethostname(), "process": os.getpid(), "started": started, "machine": _machine()}
        self._text = json.dumps(owner)
        self._stop = stop
        self.lost = ""
        """Which run has taken it over; empty while none has."""
        self._over = threading.Event()
        self._beat = threading.Thread(target=self._keep_fresh, name="lease", daemon=True)

    def __enter__(self) -> Self:
        """Raises StoreError where another run is at work there, or the folder refuses."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            while not self._taken(self._judged()):
                pass  # another run was quicker
        except OSError as error:
            raise StoreError(f"{self._path}: cannot be written: {error.strerror or error}") from None
        self._beat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._beat.join()
        with suppress(OSError), _alone(self._path.parent):
            if self._owner_text() == self._text:
                self._path.unlink()

    def _taken(self, stale: _Identity | None) -> bool:
        """Put our file there, with all that it says, where nothing is but what was found stale."""
        scratch = self._path.with_name(f".{FILE}.{socket.gethostname()}.{os.getpid()}.new")
        try:
            scratch.write_text(self._text, "utf-8")
            with _alone(self._path.parent):
                if stale is not None and self._found() == stale:
                    self._path.unlink(missing_ok=True)
                os.link(scratch, self._path)
        except FileExistsError:
            return False
        finally:
            scratch.unlink(missing_ok=True)
        return True

    def _judged(self) -> _Identity | None:
        """The lease that is there, once it is stale; None without one. Raises StoreError where it is kept fresh."""
        if self._path.is_dir() and not self._path.is_symlink():
            raise StoreError(f"{self._path}: a folder, where a run says who it is; remove it")
        found = self._found()
        if self._path.is_file() and not self._stale():
            raise StoreError(_BUSY.format(path=self._path, **_words(self._owner())))
        return found

    def _found(self) -> _Identity | None:
        """What tells whatever is there from what was there before, or was touched since."""
        with suppress(FileNotFoundError):
            found = self._path.lstat()
            return found.st_dev, found.st_ino, found.st_mtime_ns
        return None

    def _owner_text(self) -> str:
        """What the file says; empty where there is none that can be read."""
        with suppress(OSError, ValueError):
            return self._path.read_text("utf-8") if self._path.is_file() else ""
        return ""

    def _stale(self) -> bool:
        """Whether the run that holds the lease has ended; waits until that is known."""
        owner = self._owner()
        here = owner.get("host") == socket.gethostname() and owner.get("machine") == _machine()
        if here and not lives(owner["process"]):
            return True
        (first, age), patience = self._touched(), time.monotonic() + FRESH  # whatever times the file claims
        if here and age < 2.0 * BEAT:
            return False
        said = False
        while age < FRESH and time.monotonic() < patience:
            if not said and age > 2.0 * BEAT:
                said = True
                sys.stderr.write(_WAITING.format(path=self._path, seconds=FRESH - age, **_words(owner)))
            time.sleep(BEAT / 5.0)
            last, age = self._touched()
            if last != first and math.isfinite(age):
                return False
        return True

    def _owner(self) -> dict[str, Any]:
        """What the file says; empty where no run has written it."""
        with suppress(ValueError, RecursionError):
            found = json.loads(self._owner_text()[:1000])
            if isinstance(found, dict) and isinstance(found.get("process"), int) and found["process"] > 0:
                return found
        return {}

    def _touched(self) -> tuple[int, float]:
        """When the file was touched (ns), and how many seconds ago by the clock of its file system; infinite where it is gone."""
        probe = self._path.with_name(f".{FILE}.{socket.gethostname()}.{os.getpid()}.now")
        probe.touch()
        try:
            touched = self._path.stat()
            return touched.st_mtime_ns, probe.stat().st_mtime - touched.st_mtime
        except FileNotFoundError:
            return 0, math.inf
        finally:
            probe.unlink()

    def _keep_fresh(self) -> None:
        while not self._over.wait(BEAT):
            text = self._owner_text()
            if text == self._text:
                with suppress(OSError):
                    os.utime(self._path)
            elif text:  # where it is gone, nobody is at work there
                self.lost = _LOST.format(path=self._path, **_words(self._owner()))
                sys.stderr.write(f"{self.lost}\n")
                self._stop()
                return


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """While entered, no other run looks at a lease of this folder and takes it over: both are one step.

    Where the file system knows no such locks, two runs may take over one stale lease in the same instant; the first of them
    finds it lost at its next beat.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


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
