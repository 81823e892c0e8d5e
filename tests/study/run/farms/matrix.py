"""The table of faults: what each does to a run on two processes, on each of two ranks, and in a shard.

`python -m` this module writes it. All faults are in one campaign, each followed by a sound task.
"""

import json
import resource
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

from nanoslip.solver.outcome import Ending
from nanoslip.study.dataset import file
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED
from tests.conftest import clean_environment, launcher
from tests.study.run.farms.fault_program import CAMPAIGN, LOADS
from tests.study.run.farms.faults import FAULTS

README: Final = Path(__file__).with_name("README.md")
PROGRAM: Final = "tests.study.run.farms.fault_program"
SHARDS: Final = 2


class Found(NamedTuple):
    """What came of a fault."""

    ending: Ending
    message: str
    sound: bool
    """Whether the sound task behind it was finished."""
    where: str = ""
    """The rank that met it first, where the run ended otherwise than well."""


def on_two(ranks: int, rank: int) -> Callable[[Path], dict[str, Found]]:
    """A run of two processes: without a launcher, or of two ranks where this one meets the faults."""

    def run(folder: Path) -> dict[str, Found]:
        said = _run([*launcher(ranks), sys.executable, "-m", PROGRAM, str(folder), str(rank)])
        return {name: Found(**{**each, "ending": Ending(each["ending"])}) for name, each in json.loads(said).items()}

    return run


def in_shards(folder: Path) -> dict[str, Found]:
    """A campaign in shards of two processes each, merged: what its dataset says."""
    (folder / "campaign.toml").write_text(CAMPAIGN, "utf-8")
    with ThreadPoolExecutor() as pool:
        for _ in pool.map(partial(_shard, folder), range(1, SHARDS + 1)):
            pass
    _command(folder, INTERRUPTED, "merge")  # as errors of the machine may be over
    with file.read(folder / "out" / file.FILE) as dataset:
        cases = dataset[["outcome", "message"]].squeeze().load()
    endings = [Ending(each) for each in cases.outcome.values.tolist()]
    loads = cases.normal_load.values.tolist()
    return {
        name: Found(
            endings[at := loads.index(load)],
            str(cases.message.values[at]),
            endings[at + 1] is Ending.COMPLETED,
        )
        for load, name in LOADS.items()
    }


PLACES: Final[dict[str, Callable[[Path], dict[str, Found]]]] = {
    "`-j 2`": on_two(0, 0),
    "rank 0 of 2": on_two(2, 0),
    "rank 1 of 2": on_two(2, 1),
    "shard": in_shards,
}
"""Heading -> the run."""


def _shard(folder: Path, number: int) -> None:
    _command(folder, FAILURES, "run", "--shard", f"{number}/{SHARDS}", "-j", "2")


def _command(folder: Path, code: int, name: str, *options: str) -> None:
    words = [sys.executable, "-m", PROGRAM, str(folder), "nanoslip", name, "campaign.toml", "--out", "out", *options]
    _run(words, code, folder)


def _run(words: list[str], code: int = 0, folder: Path | None = None) -> str:
    """Run a program that ends with this exit code; returns its standard output."""
    done = subprocess.run(
        words,
        env=clean_environment(),
        cwd=folder,
        capture_output=True,
        timeout=600.0,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    if done.returncode != code:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.decode(errors='replace')[-2000:]}")
    return done.stdout.decode()


def main() -> None:
    """Write the table."""
    columns, seconds = [], []
    for run in PLACES.values():
        with TemporaryDirectory() as folder:
            begun = _processor_seconds()
            columns.append(run(Path(folder)))
            seconds.append(f"{_processor_seconds() - begun:.0f} s")
    sound = [f"{sum(found.sound for found in column.values())} of {len(FAULTS)}" for column in columns]
    rows = [
        ["fault", *PLACES],
        ["---"] * (1 + len(PLACES)),
        *([name, *(_cell(name, column[name]) for column in columns)] for name in FAULTS),
        ["sound tasks finished", *sound],
        ["processor time of the run", *seconds],
    ]
    README.write_text(HEAD + "".join(f"| {' | '.join(row)} |\n" for row in rows), "utf-8")


def _processor_seconds() -> float:
    """Of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _cell(name: str, found: Found) -> str:
    good = FAULTS[name].matches(found.ending, found.message)
    return f"`{found.ending}`" if good else f"**`{found.ending}`: {found.message}**"


HEAD: Final = """# What a task can do to its process

All faults are in one run, each followed by a sound task; `python -m tests.study.run.farms.matrix` writes this table. Cells
say how the faulty task ended, `completed` where the fault is no failure. Of two ranks one meets all faults, the other waits; a
task whose process dies or may be harmed is tried once more, on any rank. A time limit of 2 s (12 s in a shard) stands in for the
usual 100 times the estimate. The shards are two of a campaign of contacts, merged: its dataset says how the tasks ended.

"""

if __name__ == "__main__":
    main()
