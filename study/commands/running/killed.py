"""Tasks that were running when a whole run was killed: the next run computes them last. After a second time they have failed."""

from pathlib import Path
from typing import Final

from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.dispatch import Done
from nanoslip.study.run.executor import Diary
from nanoslip.study.run.mail import Begun

KILLED: Final = (
    "all processes of its run ended while it was computed: a defect or too little memory, its own or another task's"
)


def blame(plan: Plan, store: Store, out: Path) -> None:
    """Write down as failed what a run in this folder left begun, for good if that is so for the second time."""
    begun = Begun(out)
    if keys := begun.read().difference(store.inventory()):
        before, diary = store.failures(), Diary(out, lambda *_: None)
        for task in plan.tasks:
            known = before.get(task.key)
            if task.key in keys and not (known and known.given_up):
                second = known is not None and known.message == KILLED
                diary.fail(task, Done(task.key, Outcome(Ending.CRASHED, KILLED), 0.0, passing=not second), final=True)
    begun.close()
