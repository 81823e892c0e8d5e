"""A program for two ranks: one fault among 19 sound tasks. `fault_program FAULT RANK FOLDER`; prints what came of it as JSON."""

import json
import sys
from pathlib import Path

from solver.outcome import Outcome
from study.execution.farms.opening import open_farm
from study.execution.ledger import Done
from tests.study.execution.farms import faults
from tests.study.execution.made_up import Work


def main(fault: str, rank: int, folder: Path) -> None:
    sound = [Work(f"sound {number}") for number in range(19)]
    tasks = [*sound[:rank], Work(fault), *sound[rank:]]  # idle ranks get the first ones, in their order
    ended: dict[str, Outcome] = {}
    where: list[str] = []

    def fail(task: Work, done: Done, final: bool) -> None:
        where.append(done.where.split(" on ")[0])

    with open_farm(faults.program(folder)) as farm:
        if not farm.root:
            farm.leave(farm.serve())
        tally = farm.run(tasks, lambda tasks, outcome, _: ended.update({task.key: outcome for task in tasks}), fail)
        said = {
            "done": tally.done,
            "crashed": tally.crashed,
            "ending": ended[fault].ending,
            "as_expected": faults.as_expected(fault, ended[fault]),
            "where": where[0],
        }
        print(json.dumps(said), flush=True)
        farm.leave(3 if tally.crashed else 0)


main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
