"""The last line of a dataset's file: a checksum of all before it. netCDF ignores it; whoever changes the file removes it."""

import hashlib
import re
from pathlib import Path
from typing import Final

_LINE: Final = re.compile(rb"\nsha256 ([0-9a-f]{64})\n")
_LENGTH: Final = len("\nsha256 \n") + 64
_CHUNK: Final = 2**20


def seal(path: Path) -> None:
    """Write the line behind a file."""
    digest = _digest(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(f"\nsha256 {digest}\n".encode("ascii"))


def broken(path: Path) -> bool:
    """Whether a byte of a sealed file has changed; a file without the line has nothing to break. Raises OSError."""
    written = seal_of(path)
    return written is not None and written != _digest(path, path.stat().st_size - _LENGTH)


def seal_of(path: Path) -> str | None:
    """The checksum that a file ends with, None where it has none. Raises OSError."""
    length = path.stat().st_size - _LENGTH
    if length < 0:
        return None
    with path.open("rb") as file:
        file.seek(length)
        line = _LINE.fullmatch(file.read())
    return line[1].decode("ascii") if line else None


def _digest(path: Path, length: int) -> str:
    """Of the first bytes of a file."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (chunk := file.read(min(_CHUNK, length))):
            found.update(chunk)
            length -= len(chunk)
    return found.hexdigest()
