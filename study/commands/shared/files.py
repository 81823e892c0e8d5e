"""Files that a command writes, whole or not at all."""

from pathlib import Path

from study.commands.shared.exits import Refusal
from study.dataset.store import written_whole


def write_file(path: Path, content: bytes) -> None:
    """Write a file and the folder that it is in. Raises Refusal where that cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as scratch:
            scratch.write_bytes(content)
    except OSError as error:
        raise Refusal(f"{path}: cannot be written: {error.strerror or error}") from None
