"""What each fault does to a run on each of two ranks, and in a shard of two processes.

All faults are met by rank 0, and by rank 1 and in shards one of each way to end; each is followed by a sound task. As a program
it is that run, and what came of it goes to standard output as JSON: FOLDER RANK computes made-up tasks under a launcher of two
ranks so that this one meets the faults; FOLDER nanoslip ... is the command line with faults in a campaign.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.commands import cli, run
from nanoslip.study.dataset import file
from nanoslip.study.exit_codes import FAILURES, INTERRUPTED
from nanoslip.study.run.farm import open_farm
from nanoslip.study.run.launch import Program
from tests.conftest import clean_environment, launcher
from tests.study.run import faults
from tests.study.run.faults import FAULTS, blocker
from tests.study.run.made_up import Diary, Work

PROGRAM: Final = "tests.study.run.matrix"
SHARDS: Final = 2
EACH_WAY: Final = (
    *("exception", "half a letter in its text", "text of 2 MB", "escapes in its text", "SystemExit(0)", "MemoryError"),
    *("result None", "result lambda", "result array of objects", "os._exit(0)", "segmentation fault", "stopped"),
    *("writes into every open file", "SIGKILL to its group", "fork of which both return"),
    *("death before what it started", "other folder", "other umask", "other clock"),
    *("no space on the disk", "quota used up", "no quota for its result", "file descriptors used up"),
)
"""One of each way to end, and all that a dataset says or results are written with. How else a child ends does not depend on what
it computes, and each that hangs takes `limits.seconds` here, twice: one that is stopped takes no processor time meanwhile."""
LOADS: Final = [round(1e-3 * (1.0 + 0.01 * number), 6) for number in range(2 * len(EACH_WAY))]
FAULTY: Final = dict(zip(LOADS[::2], EACH_WAY, strict=True))
"""Load of a contact -> its fault."""
CAMPAIGN: Final = f"""\
title = "Every second contact has a fault"
stages = ["contact"]
axes.normal_load = {LOADS}
numerics.n_x = 17
limits.seconds = 8.0
"""


def met_by(rank: int) -> tuple[str, ...]:
    """Faults that a rank meets: both have the same children, and differ only in the way of the message to rank 0."""
    return EACH_WAY if rank else tuple(FAULTS)


class Found(NamedTuple):
    """What came of a fault."""

    outcome: Outcome
    sound: bool
    """Whether the sound task behind it was finished."""
    where: str = ""
    """The rank that met it first, where the run ended otherwise than well."""


def compute(folder: Path, rank: int) -> None:
    """Compute tasks with the faults that this rank is to meet, each followed by a sound one."""
    names = met_by(rank)
    tasks = [task for fault in names for task in (faults.work(fault), Work(f"sound {fault}", limit=60.0))]
    blocking = blocker(len(names))
    tasks.insert(1 - rank, blocking)  # idle ranks get the first ones, in their order
    diary = Diary()
    with open_farm(faults.program(folder)) as farm:
        if not farm.root:
            farm.leave(farm.serve())
        farm.run(tasks, diary)
        assert diary.reported[blocking.key].ok, "the other rank has not met all faults"
        ended, where = diary.reported, {key: f"rank {done.where.rank}" for key, done, _ in reversed(diary.attempts)}
        found = {
            name: (ended[name].ending, ended[name].message, ended[f"sound {name}"].ok, where.get(name, ""))
            for name in names
        }
        print(json.dumps(found), flush=True)
        farm.leave(0)


def command() -> None:
    """Run the command line."""
    real = run.task_program
    run.task_program = lambda out: Program(faults.__name__, "campaign_executor", (real(out).argument, FAULTY))
    sys.argv[:] = sys.argv[2:]
    cli.main()


def on_two(rank: int) -> Callable[[Path], dict[str, Found]]:
    """A run of two ranks where this one meets the faults."""

    def run(folder: Path) -> dict[str, Found]:
        said = json.loads(_run([*launcher(2), sys.executable, "-m", PROGRAM, str(folder), str(rank)]))
        return {name: Found(Outcome(Ending(each[0]), each[1]), *each[2:]) for name, each in said.items()}

    return run


def in_shards(folder: Path) -> dict[str, Found]:
    """A campaign in shards of two processes each, merged: what its dataset says."""
    (folder / "campaign.toml").write_text(CAMPAIGN, "utf-8")
    with ThreadPoolExecutor() as pool:
        shards = [f"{number}/{SHARDS}" for number in range(1, SHARDS + 1)]
        list(pool.map(lambda shard: _command(folder, FAILURES, "run", "--shard", shard, "-j", "2"), shards))
    _command(folder, INTERRUPTED, "merge")  # as errors of the machine may be over
    with file.open_dataset(folder / "out" / file.FILE) as dataset:
        cases = dataset[["outcome", "message"]].squeeze().load()
    told = zip(cases.outcome.values.tolist(), cases.message.values.tolist(), strict=True)
    ended = dict(
        zip(cases.normal_load.values.tolist(), (Outcome(Ending(each), said) for each, said in told), strict=True)
    )
    return {
        FAULTY[load]: Found(ended[load], ended[sound].ending is Ending.COMPLETED)
        for load, sound in zip(LOADS[::2], LOADS[1::2], strict=True)
    }


PLACES: Final[dict[str, tuple[tuple[str, ...], Callable[[Path], dict[str, Found]]]]] = {
    "rank 0 of 2": (met_by(0), on_two(0)),
    "rank 1 of 2": (met_by(1), on_two(1)),
    "shard": (EACH_WAY, in_shards),
}
"""Where faults are met -> the faults, and the run."""


def _command(folder: Path, code: int, name: str, *options: str) -> None:
    words = [sys.executable, "-m", PROGRAM, str(folder), "nanoslip", name, "campaign.toml", "--out", "out", *options]
    _run(words, code, folder)


def _run(words: list[str], code: int = 0, folder: Path | None = None) -> str:
    """Run a program that ends with this exit code; returns its standard output."""
    run = partial(subprocess.run, capture_output=True, timeout=600.0, check=False, stdin=subprocess.DEVNULL)
    done = run(words, env=clean_environment(), cwd=folder)
    if done.returncode != code:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.decode(errors='replace')[-2000:]}")
    return done.stdout.decode()


if __name__ == "__main__":
    if sys.argv[2].isdigit():
        compute(Path(sys.argv[1]), int(sys.argv[2]))
    else:
        command()
