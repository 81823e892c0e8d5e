"""The processes of one run, found by a word in their environment: its launcher, its ranks, those that compute."""

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from nanoslip.study.results.entry import lives

MARK: Final = "NANOSLIP_TRIAL"
"""Variable of the environment that all processes of a run inherit."""
RANK: Final = (b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK=")
"""How launchers tell a process which rank it is."""
TARGETS: Final = ("launcher", "rank 0", "another rank", "a child", "all of them")


def marked(mark: str) -> Iterator[tuple[int, list[bytes], list[bytes]]]:
    """The processes of a run that live: number, words of the command, environment."""
    wanted = f"{MARK}={mark}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            environment = (folder / "environ").read_bytes().split(b"\0")
            if wanted in environment:
                yield int(folder.name), (folder / "cmdline").read_bytes().split(b"\0"), environment


def remaining(mark: str) -> list[int]:
    """Those of them that have not ended."""
    return [process for process, _, _ in marked(mark) if lives(process)]


def found(target: str, mark: str, launcher: int) -> list[int]:
    """The processes of a run that are meant by the name of a target."""
    if target in ("launcher", "all of them"):
        return [launcher]
    ranks, children = {}, []
    for process, words, environment in marked(mark):
        number = next((int(each.partition(b"=")[2]) for each in environment if each.startswith(RANK)), None)
        if any(b"farms.child" in word for word in words):
            children.append(process)
        elif number is not None and b"nanoslip" in words:
            ranks[number] = process
    if target == "a child":
        return children
    return [process for number, process in ranks.items() if (number == 0) == (target == "rank 0")]


def kill(target: str, process: int, sent: signal.Signals) -> bool:
    """Send a process, or all of a launcher's group, a signal; False where it has ended."""
    with suppress(ProcessLookupError):
        (os.killpg if target == "all of them" else os.kill)(process, sent)
        return True
    return False
