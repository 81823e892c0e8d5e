"""Pictures and pages on disk: whole or not there at all."""

from collections.abc import Mapping
from pathlib import Path

from nanoslip.study.results.entry import written_whole
from nanoslip.study.results.store import StoreError


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write files with their contents, and the folders that they are in. Raises StoreError."""
    try:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            with written_whole(path) as scratch:
                scratch.write_bytes(content)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
