"""An event without its slips, and a whole small record: what is around the slips."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from nanoslip import Case, Slab, surface_compliance
from nanoslip.solver.elasticity.schemes.chain import Chain
from nanoslip.solver.sliding.slide import slide, slide_to_state
from nanoslip.study.commands.plans import plan_campaign
from nanoslip.study.tasks.compute import run_task
from tests.benchmarks.scale import campaign_of
from tests.benchmarks.table import Row, at_most, best, seconds, versus

EVENTS = 2000
LONG_EVENT = 0.7e-6
LONG_TASK = 0.8e-3
TASKS = 200


def rows() -> list[Row]:
    """An event of 30 nodes in contact, and a task of the campaigns of very many cases."""
    event, slip = _event_and_slip()
    task = _task()
    small = "task of 50 events, n_x = 33, scalars only"
    what, ratio = "an event without its slips, 30 contact nodes", f"{event / slip:.1f}"
    return [
        versus(what, event, slip, "a slip", at_most(event, LONG_EVENT), ratio=ratio),
        Row(small, seconds(task), target=at_most(task, LONG_TASK)),
    ]


def _event_and_slip() -> tuple[float, float]:
    """Seconds of each: two records of as many events, one of which has thirty times as many slips."""
    slab = Slab(n_x=65)
    many = _stretch(Case(intrinsic_friction=0.5, radius=150.0, slab=slab))
    few = _stretch(Case(intrinsic_friction=0.5, radius=100.0, slab=replace(slab, scheme=Chain(coupling_stiffness=1.0))))
    event, slip = np.linalg.solve([many[1:], few[1:]], [many[0], few[0]])
    return float(event), float(slip)


def _stretch(case: Case) -> tuple[float, int, int]:
    """Seconds, events and slips of steady sliding, without setting its tableau up."""
    compliance = surface_compliance(case.slab)
    start = slide_to_state(replace(case, max_events=300), compliance)[1]
    whole, first = replace(case, max_events=EVENTS + 1), replace(case, max_events=1)
    record, beginning = slide(whole, compliance, start), slide(first, compliance, start)
    taken = best(lambda: slide(whole, compliance, start)) - best(lambda: slide(first, compliance, start))
    return taken, EVENTS, int(record.slips.sum() - beginning.slips.sum())


def _task() -> float:
    """Processor seconds of a task, the mean over a campaign whose compliances are there."""
    with TemporaryDirectory() as folder:
        plan = plan_campaign(campaign_of(TASKS, Path(folder)))
    results = {task.key: run_task(task, {}) for task in plan.tasks if task.kind == "compliance"}
    records = [(task, {key: results[key] for key in task.needs}) for task in plan.tasks if task.kind == "record"]

    def run() -> None:
        for task, inputs in records:
            run_task(task, inputs)

    return best(run) / len(records)
