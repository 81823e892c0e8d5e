"""Files in a folder of results, the only place that opens files to write: no link is followed, no pipe is waited for.

A file appears whole or not at all, or several processes add lines to it.
"""

import errno
import fnmatch
import itertools
import os
import re
import secrets
import socket
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

NO_FILE: Final = "no regular file"


def open_regular(path: Path, flags: int = os.O_RDONLY) -> int:
    """Descriptor of a regular file, which others may have put there: never the target of a link. Raises OSError."""
    try:
        # Without O_NONBLOCK the opening of a pipe would wait for its other end, for ever.
        file = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    except FileExistsError:
        raise
    except OSError:
        if is_no_file(path):
            raise OSError(errno.EINVAL, NO_FILE) from None
        raise
    # Of what is open, not of the name: that may have been given to something else meanwhile.
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, NO_FILE)
    return file


def is_no_file(path: Path) -> bool:
    """True if a path is not a regular file: a link, a folder, a pipe or device that never ends."""
    with suppress(OSError):
        return not stat.S_ISREG(os.lstat(path).st_mode)
    return False


def matching(folder: Path, pattern: str) -> list[Path]:
    """Paths in a folder whose names match, in order; none where no folder is. Raises OSError for an unreadable
    file."""
    with suppress(FileNotFoundError, NotADirectoryError):
        names = fnmatch.filter(os.listdir(folder), pattern)
        return sorted(folder / name for name in names)
    return []


def read_bytes(path: Path) -> bytes:
    """All bytes of a regular file. Raises OSError."""
    with os.fdopen(open_regular(path), "rb") as file:
        return file.read()


def sync(path: Path) -> None:
    """Have a file outlast a loss of power. Raises OSError."""
    with os.fdopen(open_regular(path), "rb") as file:
        os.fsync(file.fileno())


VISIBLE: Final = 90.0
"""Seconds after which a network file system shows what another machine has written: clients remember folders for 60 at most."""
LOOK: Final = 1.0
"""Seconds between two looks."""


def looks() -> Iterator[None]:
    """Yield now, and again until a network file system shows all that was written before."""
    end = time.monotonic() + VISIBLE
    yield
    while time.monotonic() < end:
        time.sleep(min(LOOK, VISIBLE))
        yield


# Lines that several processes add to a file.


def append_lines(path: Path, lines: bytes) -> None:
    """Append whole lines, on a line of their own if the last one was cut short. Raises OSError."""
    with os.fdopen(open_regular(path, os.O_RDWR | os.O_APPEND | os.O_CREAT), "ab+") as file:
        # What a killed writer began must not swallow the first of these lines.
        torn = False
        if file.seek(0, os.SEEK_END):
            file.seek(-1, os.SEEK_END)
            torn = file.read(1) != b"\n"
        file.write(b"\n" * torn + lines)


def read_lines(path: Path) -> list[str]:
    """All lines that are there; none if nothing is that can be read."""
    try:
        return read_bytes(path).decode("utf-8", errors="replace").splitlines()
    except OSError:
        return []


# Files that appear whole or not at all, and what killed writers leave of them.

ABANDONED = 86_400.0
"""Seconds after which another host's scratch file is taken for a killed run's."""
_SCRATCH = ".scratch"
_SCRATCH_NAME = re.compile(rf"\..+\.([^.]+)\.(\d{{1,9}})\.[0-9a-f]+{re.escape(_SCRATCH)}")
"""Names made by `make_scratch`: host and process of the writer. Other files with this ending are foreign."""
RANDOM: Final = 8
"""Number of random bytes that make a name unique."""


@contextmanager
def writing_whole(path: Path) -> Iterator[Path]:
    """Yield a scratch file beside `path` to write to, then put it in its place: readers see the old or the new, whole.

    The mode is what the umask leaves of 0666, as for any file others shall read.
    """
    scratch = make_scratch(path)
    try:
        yield scratch
        # Before the new name: a loss of power could otherwise leave it with no bytes behind it.
        sync(scratch)
        if path.is_dir() and not path.is_symlink():
            # Kept under another name, so that nothing in it is lost.
            path.rename(free_name(path))
        os.replace(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def write_whole(path: Path, parts: Iterable[bytes]) -> None:
    """Write contents from parts in order, whole or not at all. Raises OSError."""
    with writing_whole(path) as scratch:
        write_fully(scratch, parts)


def write_fully(path: Path, parts: Iterable[bytes], flags: int = 0) -> None:
    """Write these bytes to a file, which need not appear whole. flags: O_APPEND, for example. Raises OSError."""
    with os.fdopen(open_regular(path, os.O_WRONLY | flags), "wb") as file:
        file.writelines(parts)


def make_scratch(path: Path, content: bytes = b"") -> Path:
    """Make a file beside `path`, to be written; `clear_away` removes what a killed process leaves. Raises OSError.

    Nobody can have put a link there: its name is drawn at random, and a name that is there is refused.
    """
    scratch = path.with_name(f".{path.name}.{_host()}.{os.getpid()}.{secrets.token_hex(RANDOM)}{_SCRATCH}")
    create(scratch, content)
    return scratch


def create(path: Path, content: bytes) -> None:
    """Write a file that is not there yet. Raises FileExistsError, OSError."""
    write_fully(path, [content], os.O_CREAT | os.O_EXCL)


def _host() -> str:
    return socket.gethostname().replace(".", "-")


def clear_away(folder: Path) -> None:
    """Remove the scratch files of processes that have ended."""
    for leftover in folder.glob(f".*{_SCRATCH}"):
        named = _SCRATCH_NAME.fullmatch(leftover.name)
        if named and not _writer_lives(leftover, *named.groups()):
            leftover.unlink(missing_ok=True)


def _writer_lives(scratch: Path, host: str, process: str) -> bool:
    """True if the process that writes this scratch file may still be running."""
    if host != _host():
        try:
            return time.time() - scratch.stat().st_mtime < ABANDONED
        except FileNotFoundError:
            # The process was there until just now.
            return True
    return lives(int(process))


def lives(process: int) -> bool:
    """True if a process of this machine has not ended."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return not _is_zombie(process)


def _is_zombie(process: int) -> bool:
    """True if a process is a zombie (exited, not yet reaped): containers often have no init that reaps."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        # No such file system here, or the process is gone meanwhile: the next run clears away.
        return False
    # The state follows the program's name, whose brackets may enclose further ones (proc(5)).
    return fields.rpartition(")")[2].split()[0] == "Z"


def free_name(path: Path) -> Path:
    """A name beside it that nothing has."""
    names = (path.with_name(f"{path.name}.set-aside-{number}") for number in itertools.count(1))
    return next(name for name in names if not os.path.lexists(name))


# Folders of a campaign: its own, and one for each shard, a part that a small job computes alone.


def results_folder(campaign: Path, out: Path | None) -> Path:
    """The folder of a campaign's results."""
    return out or Path("results") / campaign.stem


SHARDS: Final = "shards"
"""Folder of the shards of a campaign, inside the campaign's folder."""
MOST_SHARDS: Final = 999_999
"""Parts of a campaign."""


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several parts, numbered from 1."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a part such as `3/10`. Raises ValueError."""
        match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text, re.ASCII)
        number, of = map(int, match.groups()) if match else (0, 0)
        if not 1 <= number <= of:
            raise ValueError(f"{text}: needs NUMBER/OF, as 1/10 to 10/10, of at most {MOST_SHARDS} parts")
        return cls(number, of)

    def folder(self, out: Path) -> Path:
        """Folder of its results, below a campaign's folder."""
        digits = max(2, len(str(self.of)))
        return out / SHARDS / f"{self.number:0{digits}d}-of-{self.of:0{digits}d}"

    def __str__(self) -> str:
        return f"shard {self.number} of {self.of}"


def shard_folders(out: Path) -> list[Path]:
    """The folders of all shards that have something, of a campaign's folder."""
    return [path for path in matching(out / SHARDS, "*-of-*") if path.is_dir()]
