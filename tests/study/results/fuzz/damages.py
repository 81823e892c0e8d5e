"""What is done to a file: single bits, and rougher things. Each damage takes the folder and the file, seen from there."""

import os
import random
import shutil
import stat
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from tests.study.results.results import flip

Damage = Callable[[Path, Path], object]


def bits(path: Path, count: int, drawn: random.Random) -> Iterator[Damage]:
    """So many single bits of this file, or all where it has fewer."""
    all_bits = 8 * path.stat().st_size
    for bit in drawn.sample(range(all_bits), min(count, all_bits)):
        yield partial(_flip, bit)


def rough(path: Path, others: list[Path], cuts: int, drawn: random.Random) -> Iterator[Damage]:
    """Everything else. others: files that it changes places with."""
    length = path.stat().st_size
    for size in drawn.sample(range(length), min(cuts, length)):
        yield partial(_cut, size)
        yield partial(_overwrite, size, bytes(64))
        yield partial(_overwrite, size, drawn.randbytes(16))
        yield partial(_insert, size)
    for other in others:
        yield partial(_exchange, other)
    yield from (_to_folder, _to_full_folder, _to_pipe, _to_nothing, _to_itself, _to_socket, _to_zeros, _empty, _longer)
    yield from (_copy_beside, _strangers)


def _flip(bit: int, out: Path, path: Path) -> None:
    flip(out / path, bit)


def _cut(size: int, out: Path, path: Path) -> None:
    os.truncate(out / path, size)


def _overwrite(begin: int, content: bytes, out: Path, path: Path) -> None:
    with (out / path).open("r+b") as file:
        file.seek(begin)
        file.write(content)


def _insert(begin: int, out: Path, path: Path) -> None:
    content = (out / path).read_bytes()
    (out / path).write_bytes(content[:begin] + b"?" + content[begin:])


def _exchange(other: Path, out: Path, path: Path) -> None:
    one, two = (out / path).read_bytes(), (out / other).read_bytes()
    (out / path).write_bytes(two)
    (out / other).write_bytes(one)


def _to_folder(out: Path, path: Path) -> None:
    (out / path).unlink()
    (out / path).mkdir()


def _to_full_folder(out: Path, path: Path) -> None:
    _to_folder(out, path)
    (out / path / "mine").touch()


def _to_pipe(out: Path, path: Path) -> None:
    (out / path).unlink()
    os.mkfifo(out / path)


def _to_nothing(out: Path, path: Path) -> None:
    (out / path).unlink()
    (out / path).symlink_to("nowhere")


def _to_itself(out: Path, path: Path) -> None:
    (out / path).unlink()
    (out / path).symlink_to(path.name)


def _to_socket(out: Path, path: Path) -> None:
    (out / path).unlink()
    os.mknod(out / path, stat.S_IFSOCK | 0o600)


def _to_zeros(out: Path, path: Path) -> None:
    (out / path).unlink()
    (out / path).symlink_to("/dev/zero")


def _empty(out: Path, path: Path) -> None:
    _cut(0, out, path)


def _longer(out: Path, path: Path) -> None:
    with (out / path).open("ab") as file:
        file.write(b"more")


def _copy_beside(out: Path, path: Path) -> None:
    shutil.copy(out / path, (out / path).with_name(f"copy of {path.name}"))


def _strangers(out: Path, path: Path) -> None:
    """Names that no run gives, among them one that is no text, and one with the largest of numbers."""
    for name in (b"\xff\xfe", b"9" * 200, "²-μ".encode(), b"-", b" "):
        stranger = os.fsencode((out / path).parent) + b"/" + name + os.fsencode(path.suffix)
        shutil.copy(os.fsencode(out / path), stranger)
