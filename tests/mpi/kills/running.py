"""Runs of a campaign in processes of their own, and what they leave in its folder."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from nanoslip.study.dataset import file
from nanoslip.study.results import entry as own
from nanoslip.study.results import store as lease
from nanoslip.study.results.store import FOLDER
from nanoslip.study.run import mail as begun
from tests.conftest import clean_environment, launcher
from tests.mpi.kills.processes import MARK, remaining
from tests.study.results.results import written

PATIENCE: Final = 120.0
"""Seconds after which a run is taken to hang; each takes a few."""


@dataclass(frozen=True)
class Undisturbed:
    """What a campaign comes to that nobody kills."""

    campaign: Path
    dataset: bytes
    written: Counter[str]
    seconds: float
    """How long it took on two ranks."""


def start(campaign: Path, out: Path, ranks: int, said: Path, mark: str = "") -> "subprocess.Popen[bytes]":
    """Begin a run in a session of its own; what it says goes to a file, which outlives pipes. mark: where `out` is not enough."""
    words = [*launcher(ranks), sys.executable, "-m", "nanoslip", "run", str(campaign), "--out", str(out)]
    with said.open("ab") as log:
        return subprocess.Popen(
            words,
            env=clean_environment() | {MARK: mark or str(out)},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )


class Rival:
    """A launch of a campaign that is begun again, with other ranks, until it ends well."""

    def __init__(self, campaign: Path, out: Path, drawn: random.Random, said: Path) -> None:
        self.said = said
        self.codes: list[int] = []
        """How it has ended so far, each time."""
        self._begin = lambda: start(campaign, out, drawn.choice((0, 1, 2, 4)), said, f"{out} {said.suffix}")
        self._mark = f"{out} {said.suffix}"
        self.running = self._begin()

    @property
    def code(self) -> int | None:
        """How it has ended now; None while it runs."""
        return self.running.poll()

    def done(self) -> bool:
        """Whether it has ended well; else it is begun again where it has ended, and nothing of it is left."""
        if self.codes[-1:] == [0]:
            return True
        if (code := self.running.poll()) is not None and not remaining(self._mark):
            self.codes.append(code)
            if code:
                self.running = self._begin()
        return self.codes[-1:] == [0]

    def words(self) -> str:
        """All that it has said."""
        return self.said.read_text("utf-8", errors="replace")

    def end(self) -> None:
        """Kill what is left of it."""
        for process in remaining(self._mark):
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.running.wait(PATIENCE)


def undisturbed(name: str, text: str, folder: Path) -> Undisturbed:
    """Run a campaign on two ranks. Raises RuntimeError where that fails."""
    campaign, out, said = folder / f"{name}.toml", folder / name, folder / f"{name}.said"
    campaign.write_text(text, "utf-8")
    begun = time.monotonic()
    if start(campaign, out, 2, said).wait(PATIENCE):
        raise RuntimeError(said.read_text("utf-8"))
    return Undisturbed(campaign, (out / file.FILE).read_bytes(), written(out), time.monotonic() - begun)


def remains(out: Path) -> list[str]:
    """What a run may not leave: scratch files, a lease, word of tasks that it was at."""
    hidden = [*out.glob(".*"), *(out / FOLDER).glob(".*"), *out.glob("*set-aside*")]
    return [f"left {path.name}" for path in (*hidden, out / lease.FILE, out / begun.FILE) if path.exists()]


def own_files(out: Path) -> dict[str, int]:
    """Results in files of their own, and what tells each from one that was written anew."""
    return {path.name: path.stat().st_ino for path in (out / FOLDER).glob(f"*{own.ENDING}")}


def logs(out: Path) -> dict[str, bytes]:
    """Name -> content of each log."""
    return {path.name: path.read_bytes() for path in (out / FOLDER).glob("*.log")}
