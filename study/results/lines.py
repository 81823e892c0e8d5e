"""Files of lines that several processes add to, one line of JSON for each thing that is known."""

import os
from pathlib import Path


def add(path: Path, lines: bytes) -> None:
    """Write whole lines behind the others, and on a line of their own where the last one was cut short. Raises OSError."""
    with path.open("ab+") as file:
        torn = file.tell() > 0 and file.seek(-1, os.SEEK_END) and file.read(1) != b"\n"
        file.write(b"\n" * bool(torn) + lines)
