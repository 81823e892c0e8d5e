"""However many processes read the results, the dataset has the same bytes; one that dies is said, and nothing is written."""

import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest

from nanoslip.study.dataset import collect as entering
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import InPieces, collect
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.results.store import Store, StoreError
from tests.conftest import SMALL
from tests.study.dataset.campaigns import Build

SCALARS = f"{SMALL}\n[outputs]\nrecords = false\ntrajectory = false\nphases = false\n"
IN_PIECES = "from nanoslip.study.dataset import collect; collect.CASES = 1; import nanoslip; nanoslip.main()"
"""A process of its own: where threads run beside, later Pythons warn of forks."""


@pytest.mark.parametrize("text", [SCALARS, SMALL], ids=["scalars", "runs"])
def test_the_bytes_are_the_same_on_any_number_of_processes(build: Build, tmp_path: Path, text: str) -> None:
    plan, store = build(text)
    file.write(collect(plan, store), tmp_path / file.FILE)
    out = store.folder.parent
    for jobs in (1, 2, 3):
        words = [sys.executable, "-c", IN_PIECES, "collect", plan.manifest.path, "--out", out, "-j", jobs]
        subprocess.run(list(map(str, words)), check=True, capture_output=True, timeout=300)
        assert (out / file.FILE).read_bytes() == (tmp_path / file.FILE).read_bytes()


def test_a_process_that_dies_is_said(build: Build, monkeypatch: pytest.MonkeyPatch) -> None:
    class Dying:
        def __init__(self, *_: Any) -> None: ...

        def __enter__(self) -> "Dying":
            return self

        def __exit__(self, *_: object) -> None: ...

        def map(self, *_: Any) -> Any:
            raise BrokenProcessPool

    monkeypatch.setattr(entering, "ProcessPoolExecutor", Dying)
    plan, store = build(SCALARS)
    with pytest.raises(StoreError, match="died, perhaps for want of memory: collect with fewer jobs"):
        collect(InPieces(load_manifest(plan.manifest.path)), Store(store.folder.parent), processes=2)
