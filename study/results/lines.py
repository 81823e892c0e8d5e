"""Files of lines that several processes add to, one line of JSON for each thing that is known."""

import errno
import os
from pathlib import Path
from typing import Final

NO_FILE: Final = "no regular file"


def add(path: Path, lines: bytes) -> None:
    """Write whole lines behind the others, and on a line of their own where the last one was cut short. Raises OSError."""
    if is_no_file(path):
        raise OSError(errno.EINVAL, NO_FILE)
    with path.open("ab+") as file:
        torn = file.tell() > 0 and file.seek(-1, os.SEEK_END) and file.read(1) != b"\n"
        file.write(b"\n" * bool(torn) + lines)


def read(path: Path) -> list[str]:
    """All lines that are there; none where nothing is that can be read."""
    try:
        return path.read_text("utf-8", errors="replace").splitlines() if path.is_file() else []
    except OSError:
        return []


def is_no_file(path: Path) -> bool:
    """Whether something else stands in the place of a file: a folder, a link to nothing, a pipe or device that never ends."""
    return os.path.lexists(path) and not path.is_file()
