"""Do estimated seconds come true before a task has run? All share one factor, the machine's: the median of their ratios."""

import statistics

from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.estimates import TASK, estimate
from tests.benchmarks.table import Row, best, verdict, versus
from tests.study.plan.test_cost import TASKS, needs

MOST = 10.0
"""What an estimate may be off by: enough to order tasks until the first of a campaign have been measured."""


def rows() -> list[Row]:
    """A row of each kind of task, ours the estimate of this machine."""
    found = {}
    for name, task in TASKS.items():
        inputs = needs(task)
        # What handing out, reading and writing take is in the estimate, and does not happen here.
        found[name] = estimate(task)[0], best(lambda task=task, inputs=inputs: run_task(task, inputs), 3) + TASK
    machine = statistics.median(ours / peer for ours, peer in found.values())
    return [
        versus(
            f"estimate of: {name}",
            ours / machine,
            peer,
            "as run",
            verdict("within a factor of 10", 1 / MOST < ours / machine / peer < MOST),
        )
        for name, (ours, peer) in found.items()
    ]
