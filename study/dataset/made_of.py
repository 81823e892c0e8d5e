"""Whether a dataset's file is up to date with the results on disk. If so, they need not be collected again."""

import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import Final

from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset.seal import seal_of
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import all_sources_hash
from nanoslip.study.plan.grids import load_front
from nanoslip.study.results.entry import written_whole
from nanoslip.study.results.store import Store

NOTE: Final = "dataset.json"
"""File among the results that says what the dataset beside them was made of."""


def made_of(manifest: Manifest, store: Store) -> str:
    """A hash of all that decides a dataset: the campaign, its results and failures, and the code that collects them."""
    front = load_front(manifest.front, manifest.front_text)
    texts = (manifest.text, manifest.table_text, manifest.profile_text, front.sha256)
    asked = content_hash(all_sources_hash(), manifest.path.name, *texts)
    found = hashlib.sha256(asked.encode())
    for key, seal in store.seals():
        found.update(f"{key} {seal}\n".encode())
    for key, attempt in sorted(store.failures().items()):
        found.update(f"{key} {attempt.outcome}\n".encode())
    return found.hexdigest()


def is_made_of(path: Path, store: Store, expected: str) -> bool:
    """Whether the file is the one that was last written, of just these results. Its bytes are checked when it is opened."""
    try:
        if not (store.folder / NOTE).is_file():  # to read a pipe would never end
            return False
        said = json.loads((store.folder / NOTE).read_text("utf-8"))
        return bool(said == _said(path, expected))
    except (OSError, ValueError, RecursionError):
        return False


def note(path: Path, store: Store, made: str) -> None:
    """Write down of what the file was made; where that cannot be, it is collected again next time."""
    with suppress(OSError), written_whole(store.folder / NOTE) as scratch:
        scratch.write_text(json.dumps(_said(path, made)), "utf-8")


def _said(path: Path, made: str) -> dict[str, object]:
    return {"made_of": made, "seal": seal_of(path), "bytes": path.stat().st_size}
