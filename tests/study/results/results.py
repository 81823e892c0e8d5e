"""Made-up results, as tests of their files share them, and what is done to files."""

import os
import struct
import subprocess
import time
import zlib
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results import entry as own
from nanoslip.study.results import log
from nanoslip.study.results.entry import ALIGNED, LEAST, MARK
from nanoslip.study.results.store import FOLDER

RECORD: Final = TaskResult(
    "0123456789abcdef0123",
    "record",
    Outcome(Ending.CASCADE_LIMIT, "one event needed more slips than slip.cascade_limit (μ_i = 0.5)"),
    {"plateau_mean": [0.1 + 0.2, 0.3], "plateau_std": [float("nan"), 0.1], "events": [np.int64(3), 0]},
    {
        "displacement": np.array([0.1, 0.2, 0.3]),
        "kind": np.array([0, 1, 2], dtype=np.int8),
        "none": np.empty(0),
        "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    },
    (Outcome(Ending.CASCADE_LIMIT, "one event"), Outcome(Ending.NO_PLATEAU, "raise limits.events")),
)
COMPLIANCE: Final = TaskResult(
    "fedcba98765432100123", "compliance", COMPLETED, {}, {"matrix": np.arange(16.0).reshape(4, 4)}
)
REFUSED: Final = TaskResult("00000000000000000000", "compliance", Outcome(Ending.SINGULAR_OPERATOR, "no support"))
OTHER: Final = replace(RECORD, key="aaaaaaaaaaaaaaaaaaaa", scalars={"plateau_mean": [0.5]}, members=())
ALL: Final = (RECORD, COMPLIANCE, REFUSED, OTHER)


def written(out: Path) -> Counter[str]:
    """How often each result of a campaign was kept, in whatever file."""
    folder = out / FOLDER
    places = (found for path in folder.glob(f"*{log.ENDING}") for found in log.scan(path))
    kept = Counter(found.head.key for found in places if isinstance(found, log.Place))
    return kept + Counter(path.stem for path in folder.glob(f"*{own.ENDING}"))


def until_written(out: Path, results: int, running: "subprocess.Popen[str]") -> None:
    """Wait until a run has kept so many results of a campaign, and see that it goes on."""
    while len(written(out)) < results:
        assert running.poll() is None
        time.sleep(0.002)


CLIENT: Final = """
import os

kept, write, fsync, close = {}, os.write, os.fsync, os.close

def keep(file, content):
    if not os.readlink(f"/proc/self/fd/{file}").endswith(".log"):
        return write(file, content)
    kept[file] = kept.get(file, b"") + bytes(content)
    return len(content)

def let_go(act):
    def acted(file):
        if content := kept.pop(file, b""):
            write(file, content)
        act(file)
    return acted

os.write, os.fsync, os.close = keep, let_go(fsync), let_go(close)
"""
"""As `sitecustomize`: a client of a network file system, which keeps what is written to logs until they are synced or closed."""


def as_clients(folder: Path) -> str:
    """A PYTHONPATH with which each process is such a client."""
    (folder / "sitecustomize.py").write_text(CLIENT)
    return f"{folder}{os.pathsep}{Path(__file__).parents[3]}"


def same(one: TaskResult, other: TaskResult) -> bool:
    """Whether two results say the same, to the last bit, in arrays that lie in memory alike."""
    return (
        (one.key, one.kind, one.outcome, one.members, one.origins)
        == (other.key, other.kind, other.outcome, other.members, other.origins)
        and one.scalars.keys() == other.scalars.keys()
        and all(np.array_equal(one.scalars[name], other.scalars[name], equal_nan=True) for name in one.scalars)
        and one.arrays.keys() == other.arrays.keys()
        and all(np.array_equal(one.arrays[name], other.arrays[name]) for name in one.arrays)
        and all(one.arrays[name].dtype == other.arrays[name].dtype for name in one.arrays)
        and all(one.arrays[name].strides == other.arrays[name].strides for name in one.arrays)
    )


def forged(
    meta: bytes = b"{}", body: bytes = b"", numbers: int | None = None, table: int = 0, key: bytes = RECORD.key.encode()
) -> bytes:
    """An entry whose checksums are right, whatever it holds; numbers: the bytes that its head asks for."""
    meta, body = meta + b" " * (-(LEAST + len(meta)) % ALIGNED), body + bytes(-len(body) % ALIGNED)
    asked = len(body) if numbers is None else numbers
    head = struct.pack("<8s20sIIQI", MARK, key, len(meta), table, asked, zlib.crc32(body))
    return head + struct.pack("<I", zlib.crc32(meta, zlib.crc32(head))) + meta + body


def flip(path: Path, bit: int) -> None:
    """Change one bit of a file."""
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _nowhere(path: Path) -> None:
    path.symlink_to("nothing")


NO_FILES: Final = pytest.mark.parametrize(
    "no_file", [Path.mkdir, _pipe, _endless, _nowhere], ids=["folder", "pipe", "endless device", "link to nothing"]
)
"""What can stand where a file should, each put there by a function. To read some of them never ends."""
