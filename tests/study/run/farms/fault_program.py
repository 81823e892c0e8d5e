"""Runs in which every fault meets a process; what came of it goes to standard output as JSON.

`fault_program FOLDER RANK` computes made-up tasks, every second one with a fault: on two processes, or under a launcher of two
ranks so that this one meets the faults. `fault_program FOLDER nanoslip ...` is the command line with faults in a campaign.
"""

import json
import sys
from pathlib import Path

from nanoslip.solver.outcome import Outcome
from nanoslip.study.commands import cli, run
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.launch import Program, processes_started
from nanoslip.study.run.mpi import open_farm
from tests.study.run.farms import faults
from tests.study.run.farms.faults import BLOCKER, FAULTS
from tests.study.run.made_up import Work

LOADS = dict(
    zip((round(1e-3 * (1.0 + 0.01 * number), 6) for number in range(2 * len(FAULTS))[::2]), FAULTS, strict=True)
)
"""Load of a contact -> its fault."""
CAMPAIGN = f"""\
title = "Every second contact has a fault"
stages = ["contact"]
axes.normal_load = {[round(1e-3 * (1.0 + 0.01 * number), 6) for number in range(2 * len(FAULTS))]}
numerics.n_x = 17
limits.seconds = 12.0
"""


def main(folder: Path, rank: int) -> None:
    """Compute tasks with all faults, each followed by a sound one."""
    tasks = [task for fault in FAULTS for task in (faults.work(fault), Work(f"sound {fault}", limit=60.0))]
    if processes_started() > 1:
        tasks.insert(1 - rank, BLOCKER)  # idle ranks get the first ones, in their order
    ended: dict[str, Outcome] = {}
    where: dict[str, str] = {}

    def fail(task: Work, done: Done, final: bool) -> None:
        where.setdefault(task.key, done.where.split(" on ")[0])

    with open_farm(faults.program(folder), jobs=None if processes_started() > 1 else 2) as farm:
        if not farm.root:
            farm.leave(farm.serve())
        farm.run(tasks, lambda tasks, outcome, _: ended.update({task.key: outcome for task in tasks}), fail)
        found = {
            fault: {
                "ending": ended[fault].ending,
                "message": ended[fault].message,
                "where": where.get(fault, ""),
                "sound": ended[f"sound {fault}"].ok,
            }
            for fault in FAULTS
        }
        print(json.dumps(found), flush=True)
        farm.leave(0)


def command(folder: Path) -> None:
    """Run the command line."""
    real = run.computing
    run.computing = lambda out: Program(faults.__name__, "campaign_executor", (real(out).argument, LOADS))
    sys.argv[:] = sys.argv[2:]
    cli.main()


if __name__ == "__main__":
    if sys.argv[2].isdigit():
        main(Path(sys.argv[1]), int(sys.argv[2]))
    else:
        command(Path(sys.argv[1]))
