"""Runs of a campaign in processes of their own, and what they leave in its folder."""

import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from study.dataset import file
from study.execution.farms import begun
from study.results import lease, own
from study.results.store import FOLDER
from tests.conftest import clean_environment, launcher
from tests.mpi.kills.processes import MARK
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


def start(campaign: Path, out: Path, ranks: int, said: Path) -> "subprocess.Popen[bytes]":
    """Begin a run in a session of its own; what it says goes to a file, which outlives pipes."""
    words = [*launcher(ranks), sys.executable, "-m", "study", "run", str(campaign), "--out", str(out)]
    with said.open("wb") as log:
        return subprocess.Popen(
            words,
            env=clean_environment() | {MARK: str(out)},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )


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
