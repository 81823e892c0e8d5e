"""Made-up results, as tests of their files share them, and what is done to files."""

import os
import stat
import struct
import subprocess
import time
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.results import entry as own
from nanoslip.study.results.entry import ALIGNED, LEAST, MARK
from nanoslip.study.results.store import FOLDER
from nanoslip.study.tasks.kind import KINDS, result_names
from nanoslip.study.tasks.task import TaskResult

_PLATEAU, _EVENTS, _COLUMNS = result_names(KINDS["record"])[1:4]
_NAMES: Final = sorted(each for part in (_PLATEAU, _EVENTS, _COLUMNS) for each in part.scalars | part.undeclared)
RECORD: Final = TaskResult(
    "0123456789abcdef0123",
    "record",
    Outcome(Ending.CASCADE_LIMIT, "one event needed more slips than slip.cascade_limit (μ_i = 0.5)"),
    {
        **{name: [0.25, 0.5] for name in _NAMES},
        "plateau_mean": [0.1 + 0.2, 0.3],
        "plateau_std": [float("nan"), 0.1],
        "events": [np.int64(3), 0],
        "event_rows": [3, 0],
        "record_node_rows": [0, 0],
    },
    {
        **{name: np.zeros(3 if along == "event" else 0) for name, along in _COLUMNS.columns.items()},
        "displacement": np.array([0.1, 0.2, 0.3]),
        "kind": np.array([0, 1, 2], dtype=np.int8),
    },
    (Outcome(Ending.CASCADE_LIMIT, "one event"), Outcome(Ending.NO_PLATEAU, "raise limits.events")),
)
COMPLIANCE: Final = TaskResult(
    "fedcba98765432100123", "compliance", COMPLETED, {}, {"matrix": np.asfortranarray(np.arange(16.0).reshape(4, 4))}
)
REFUSED: Final = TaskResult("00000000000000000000", "compliance", Outcome(Ending.SINGULAR_OPERATOR, "no support"))
OTHER: Final = replace(RECORD, key="aaaaaaaaaaaaaaaaaaaa", scalars={name: [0.5] for name in _NAMES}, members=())
ALL: Final = (RECORD, COMPLIANCE, REFUSED, OTHER)


def written(out: Path) -> Counter[str]:
    """How often each result of a campaign was kept, in whatever file."""
    found = [each for path in (out / FOLDER).glob(f"*{own.LOGS}") for each in own.scan(path)]
    kept = [each.head.key for each in found if isinstance(each, own.LocatedEntry)]
    return Counter(kept + [path.stem for path in (out / FOLDER).glob(f"*{own.ENDING}")])


@contextmanager
def forbidden(folder: Path) -> Iterator[None]:
    """Have this process unable to read a folder, even where it is root. Those above need to be open to all."""
    user = os.geteuid()
    folder.chmod(0)
    if user == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(user)
        folder.chmod(0o755)


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


NODE: Final = """
import os

node = os.environ.get("PMI_RANK", os.environ.get("OMPI_COMM_WORLD_RANK", "0"))
"""
"""Number of the node that a process is on, if each rank has its own."""
REMEMBERING: Final = f"""{NODE}
import builtins, io, time
from pathlib import Path
from urllib.parse import quote

here, memory = os.path.dirname(os.path.abspath(__file__)), os.path.join(os.path.dirname(os.path.abspath(__file__)), "memory")
stat, os_open, scandir, mkdir = os.stat, os.open, os.scandir, os.mkdir
mkdir(memory) if node == "0" and not os.path.exists(memory) else None

def above(path):
    path = os.path.abspath(os.fsdecode(path))
    return [str(each) for each in (*reversed(Path(path).parents), Path(path)) if str(each).startswith(here + "/out")]

def note(path):
    return os.path.join(memory, node + "-" + quote(path, ""))

def there(path):
    try:
        stat(path)
    except OSError:
        return False
    return True

def remembering(act, makes=False):
    def acted(path, *words, **more):
        if isinstance(path, int):
            return act(path, *words, **more)
        parts = above(path)
        for part in parts[: len(parts) - makes]:
            if there(note(part)) and time.time() - stat(note(part)).st_mtime < 30.0:
                raise FileNotFoundError(2, "No such file or directory", path)
            if not there(part):
                os.close(os_open(note(part), os.O_CREAT | os.O_WRONLY))
                break
        found = act(path, *words, **more)
        if parts and there(note(parts[-1])):
            os.remove(note(parts[-1]))
        return found
    return acted

def opened(path, flags, *words, **more):
    return remembering(os_open, bool(flags & os.O_CREAT))(path, flags, *words, **more)

def named(act):
    def acted(source, path, *words, **more):
        found, parts = act(source, path, *words, **more), above(path)
        if parts and there(note(parts[-1])):
            os.remove(note(parts[-1]))
        return found
    return acted

os.link, os.replace, os.rename = (named(act) for act in (os.link, os.replace, os.rename))
os.stat, os.lstat, os.scandir, os.listdir = (remembering(act) for act in (stat, os.lstat, scandir, os.listdir))
os.open, os.mkdir = opened, remembering(mkdir, True)
"""
"""A client for each rank, which remembers for 30 s that something was not there."""
OTHER_NUMPY: Final = f"""{NODE}
from importlib import metadata

version = metadata.version
metadata.version = lambda name: "1.0.0" if (name, node) == ("numpy", "1") else version(name)
"""
"""Rank 1 has another numpy than the others."""


def as_clients(folder: Path, text: str = CLIENT) -> str:
    """A PYTHONPATH with which each process is such a client. text: what it does when it starts."""
    (folder / "sitecustomize.py").write_text(text)
    return f"{folder}{os.pathsep}{Path(__file__).parents[3]}"


def _content(result: TaskResult) -> tuple[object, ...]:
    scalars = repr({name: np.asarray(result.scalars[name]).tolist() for name in sorted(result.scalars)})
    arrays = {name: (each.dtype, each.shape, each.strides, each.tobytes()) for name, each in result.arrays.items()}
    return result.key, result.kind, result.outcome, result.members, result.origins, scalars, arrays


def same(one: TaskResult, other: TaskResult) -> bool:
    """Whether two results say the same, to the last bit, in arrays that lie in memory alike."""
    return _content(one) == _content(other)


def forged(
    meta: bytes = b"{}", body: bytes = b"", numbers: int | None = None, table: int = 0, key: bytes = RECORD.key.encode()
) -> bytes:
    """An entry whose checksums are right, whatever it holds; numbers: the bytes that its head asks for."""
    meta, body = meta + b" " * (-(LEAST + len(meta)) % ALIGNED), body + bytes(-len(body) % ALIGNED)
    asked = len(body) if numbers is None else numbers
    head = struct.pack("<8s20sIIQI", MARK, key, len(meta), table, asked, zlib.crc32(body))
    return head + struct.pack("<I", zlib.crc32(meta, zlib.crc32(head))) + meta + body


def flipped(content: bytes, bit: int) -> bytes:
    """The same bytes, one bit of which is another."""
    return b"".join((content[: bit // 8], bytes([content[bit // 8] ^ 1 << bit % 8]), content[bit // 8 + 1 :]))


def flip(path: Path, bit: int) -> None:
    """Change one bit of a file."""
    path.write_bytes(flipped(path.read_bytes(), bit))


def full_folder(path: Path) -> None:
    """With something of the user's in it."""
    path.mkdir()
    (path / "mine").write_text("kept")


OBSTACLES: Final = {
    "folder": Path.mkdir,
    "full folder": full_folder,
    "pipe": os.mkfifo,
    "socket": lambda path: os.mknod(path, stat.S_IFSOCK | 0o600),
    "endless device": lambda path: path.symlink_to("/dev/zero"),
    "link to nothing": lambda path: path.symlink_to("nothing"),
    "link to itself": lambda path: path.symlink_to(path.name),
}
"""What can stand where a file should, each put there by a function. To read some of them never ends."""
NO_FILES: Final = pytest.mark.parametrize("no_file", OBSTACLES.values(), ids=OBSTACLES)
