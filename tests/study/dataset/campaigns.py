"""Small campaigns, computed, and what tests of their datasets share."""

from collections.abc import Callable

from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.compute import run_task
from tests.conftest import SMALL

Build = Callable[[str], tuple[Plan, Store]]


CASE_DIMS = ("intrinsic_friction", "radius", "aspect_ratio", "n_x")


TABLE = "intrinsic_friction, radius\n0.25, 50\n0.5, 50\n0.5, 100\n"


def compute(plan: Plan, store: Store) -> None:
    """Compute what the store has not yet."""
    store.prepare()
    for task in plan.remaining(store.finished()):
        store.write(run_task(task, {key: store.read(key) for key in task.needs}), task.shared)


def changed(**replacements: str) -> str:
    """The small campaign with some of its lines replaced, by the word they start with."""
    lines = [replacements.get(line.split(" ")[0], line) for line in SMALL.splitlines()]
    return "\n".join(lines) + "\n"
