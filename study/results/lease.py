"""One run at a time in a folder: two would compute everything twice, and the first would drop what the second still reads.

Whoever runs keeps a file fresh that says who it is. It is stale when its process has ended, or when nobody has touched it for
a minute, by the clock of the file system that holds it: the run was killed, on whatever host.
"""

import json
import math
import os
import socket
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Self

from study.results.store import StoreError
from study.results.whole_file import lives

FILE: Final = "running.json"
FRESH: Final = 60.0
"""Seconds without a touch after which a lease is stale."""
CALM: Final = 0.05
"""Seconds after which runs that have found a stale lease together see which of them has it."""
BEAT: Final = 5.0
"""Seconds between touches."""


class Lease:
    """While entered, no other run may use the folder."""

    def __init__(self, out: Path) -> None:
        self._path = out / FILE
        started = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime())
        owner = {"host": socket.gethostname(), "process": os.getpid(), "started": started, "machine": _machine()}
        self._text = json.dumps(owner)
        self._over = threading.Event()
        self._beat = threading.Thread(target=self._keep_fresh, name="lease", daemon=True)

    def __enter__(self) -> Self:
        """Raises StoreError where another run is at work there, or the folder refuses."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            while not self._taken():
                self._put_aside()
        except OSError as error:
            raise StoreError(f"{self._path}: cannot be written: {error.strerror or error}") from None
        self._beat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._beat.join()
        if self._is_ours():  # else another run has taken it for stale
            self._path.unlink(missing_ok=True)

    def _taken(self) -> bool:
        """Make the file, with all that it says, unless it is there."""
        scratch = self._path.with_name(f".{FILE}.{socket.gethostname()}.{os.getpid()}.new")
        try:
            scratch.write_text(self._text, "utf-8")
            os.link(scratch, self._path)
        except FileExistsError:
            return False
        finally:
            scratch.unlink(missing_ok=True)
        time.sleep(CALM)
        return self._is_ours()

    def _is_ours(self) -> bool:
        with suppress(OSError):
            return self._path.read_text("utf-8") == self._text
        return False

    def _put_aside(self) -> None:
        """Remove the lease that is there, once it is stale. Raises StoreError where it is kept fresh."""
        if self._path.is_dir() and not self._path.is_symlink():
            raise StoreError(f"{self._path}: a folder, where a run says who it is; remove it")
        text = self._path.read_bytes() if self._path.is_file() else None
        if text is not None and not self._stale():
            raise StoreError(_BUSY.format(path=self._path, **_words(self._owner())))
        aside = self._path.with_name(f".{FILE}.{socket.gethostname()}.{os.getpid()}.stale")
        with suppress(FileNotFoundError):  # another run was quicker
            self._path.rename(aside)
            if text is not None and aside.read_bytes() != text and not os.path.lexists(self._path):
                aside.rename(self._path)  # it was, and this is its own
            else:
                aside.unlink()

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
        with suppress(OSError, ValueError, RecursionError):
            found = json.loads(self._path.read_text("utf-8")[:1000])
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
            with suppress(OSError):
                if self._is_ours():  # a run that was stopped for long may have lost it
                    os.utime(self._path)


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
