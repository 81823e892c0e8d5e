"""Small campaigns, computed, and what tests of their datasets share."""

from collections.abc import Callable

from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.compute import run_task
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


FULL = {
    "title": "Everything",
    "stages": ["contact", "slip", "dynamics"],
    "axes": {"intrinsic_friction": [0.25, 0.5], "radius": [50.0, 100.0]},
    "numerics": {"n_x": 17},
    "limits": {"events": 200},
    "ensemble": {"members": 1},
    "drives": [{"name": "slow", "stage_velocity": 1e-3, "samples": 40}, {"name": "fast", "samples": 40}],
    "outputs": {"tractions": True, "tractions_at": [3, 5], "subsurface": True},
}
"""A campaign with everything that a dataset can hold beside its scalars."""
