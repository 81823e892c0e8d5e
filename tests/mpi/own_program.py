"""A user's own program over three ranks: two of them compute campaigns with `comm=`, which leaves its messages and MPI alone."""

import sys
import warnings
from collections import Counter
from pathlib import Path

from mpi4py import MPI

import nanoslip
from nanoslip.study import api
from nanoslip.study.run.launch import Program


def main(out: Path, *campaigns: str) -> None:
    world = MPI.COMM_WORLD
    part = world.Split(int(world.rank == 1), world.rank)
    said = []
    if world.rank != 1:
        warnings.simplefilter("ignore", RuntimeWarning)  # of tasks that fail
        own = part.isend("my own message", dest=1 - part.rank)
        for number, campaign in enumerate(campaigns):
            try:
                data = nanoslip.run(campaign, out / str(number), comm=part, progress=False)
                said.append("None" if data is None else str(dict(Counter(data.outcome.values.ravel()))))
            except nanoslip.NanoslipError as error:
                said.append(type(error).__name__)
        said.append(part.recv())
        own.wait()
    for each in world.gather(said) or ():
        print(", ".join(each), flush=True)
    assert MPI.Is_initialized()
    assert not MPI.Is_finalized()


if __name__ == "__main__":
    deadly = {2e-3: "kill -9"}
    api.task_program = lambda out: Program("tests.study.run.faults", "campaign_executor", (out, deadly))  # type: ignore[assignment]
    main(Path(sys.argv[1]), *sys.argv[2:])
