"""Results and keys of a few tiny cases, as recorded: a solver that gives others needs another version, or old results pass for
new.

`python -m tests.study.plan.test_recorded` records them anew.
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.statistics import statistics_task
from nanoslip.study.tasks.task import SOLVER_VERSION, Task, TaskResult
from tests.study.plan.running import first

RECORDED = Path(__file__).with_name("recorded.json")
SLAB = Slab(17)
STEADY = Case(radius=50.0, slab=SLAB, max_events=60)
SLID = replace(STEADY, intrinsic_friction=0.3, max_events=300)
"""Long enough for a steady part, and of sizes whose laws hang on no last digit."""
SMOOTH: Drive = NamedDrive.of("paper", duration=0.2, samples=50, profile="mean").dimensionless(Scales())
"""Over the teeth themselves a last digit of the record turns the motion."""
FIRST_TEETH: Drive = NamedDrive.of("paper", samples=50, duration=0.005).dimensionless(Scales())
ROUGH = Heterogeneity(roughness=((-0.1, 0.0), (0.1, 1e-6)))
TASKS: dict[str, tuple[Task, ...]] = {
    "contact of a punch": (contact_task(Case(pin="flat_punch", slab=SLAB)),),
    "contact without a matrix": (
        contact_task(Case(slab=Slab(17, scheme="half_plane"), effects=Effects(friction=False), heterogeneity=ROUGH)),
    ),
    "gradual contact": (contact_task(Case(radius=50.0, slab=SLAB, initial_contact="gradual")),),
    "record": (record_task(STEADY),),
    "record of the paper's scheme": (
        record_task(Case(radius=50.0, slab=Slab(17, scheme="biquadratic"), max_events=40)),
    ),
    "statistics": (record_task(SLID), statistics_task(SLID)),
    "classical sliding": (
        record_task(Case(radius=50.0, slab=SLAB, slip_rule=SlipRule(residual_shear=1.0), max_events=20)),
    ),
    "pressures frozen": (
        record_task(Case(radius=50.0, slab=SLAB, effects=Effects(pin_translation=False), max_events=40)),
    ),
    "spread": (record_task(Case(radius=50.0, slab=SLAB, heterogeneity=Heterogeneity(spread=0.1), max_events=40)),),
    "drive against the mean force": (record_task(SLID), drive_task(SLID, SMOOTH)),
    "drive over teeth": (record_task(SLID), drive_task(SLID, FIRST_TEETH)),
}
NAMED: dict[str, Task] = {
    "compliance": compliance_task(SLAB),
    "compliance of a chain": compliance_task(Slab(17, scheme="chain")),
    "contact of a punch, scalars": contact_task(Case(pin="flat_punch", slab=SLAB), scalars_only=True),
    "contact without coupling": contact_task(replace(STEADY, effects=Effects(coupling=False))),
    "record, scalars": record_task(STEADY, scalars_only=True),
    "record without friction": record_task(replace(STEADY, intrinsic_friction=0.0)),
    "record of adhesive stick": record_task(replace(STEADY, intrinsic_friction=math.inf)),
    "record of a rough pin": record_task(replace(STEADY, heterogeneity=ROUGH)),
    "record to a displacement": record_task(replace(STEADY, max_events=None, max_spacings=2.0, start=0.25)),
    "states": states_task(STEADY, (0, 3), False),
    "states at first, inside": states_task(STEADY, (0,), True),
    "drive, scalars, unfitted": drive_task(STEADY, SMOOTH, scalars_only=True, fitted=False),
    **{f"last of: {label}": tasks[-1] for label, tasks in TASKS.items()},
}
"""Tasks whose keys are recorded."""
TOLERANCE = 1e-9
"""Libraries and threads round differently, 3e-11 was seen; a change of the solver that is one moves a number further."""
DIFFERENCE_OF = {
    **dict.fromkeys(("static_excess", "fluctuation", "plateau_drift", "plateau_stress_drift", "plateau_std"), 1.0),
    "plateau_event_drift": 1.0,
    **dict.fromkeys(("friction_force", "initial_force"), STEADY.normal_load),
}
"""Number that is a difference -> size of what it is a difference of: F/W, of order one, forces that add up to the load, or the
events of halves of a plateau over their mean. If these are equal, only their rounding is left, which each kernel of OpenBLAS
does differently."""


def computed(label: str) -> dict[str, float]:
    """The finite numbers of the last of some tasks."""
    results: dict[str, TaskResult] = {}
    for task in (compliance_task(TASKS[label][0].slab), *TASKS[label]):
        results[task.key] = run_task(task, results)
    return {name: number for name, number in first(results[TASKS[label][-1].key]).items() if math.isfinite(number)}


def allowed(name: str, recorded: float) -> object:
    """The numbers that equal a recorded one."""
    return pytest.approx(recorded, rel=TOLERANCE, abs=max(TOLERANCE * DIFFERENCE_OF.get(name, 0.0), 1e-15))


@pytest.mark.parametrize("label", TASKS)
def test_a_result_that_changed_has_another_solver_version(label: str) -> None:
    recorded = json.loads(RECORDED.read_text("utf-8"))
    assert recorded["solver_version"] == SOLVER_VERSION, "run python -m tests.study.plan.test_recorded"
    found, known = computed(label), recorded["results"][label]
    assert known
    changed = {name: found.get(name) for name in known if found.get(name) != allowed(name, known[name])}
    assert not changed, (
        f"results of '{label}' changed: raise the solver version (nanoslip.study.tasks.task), and record them "
        f"anew: {changed}"
    )
    # Stored results that lack a number stay results (tests/study/results/test_other_versions.py): no other version for it.
    assert known.keys() == found.keys(), "new numbers: run python -m tests.study.plan.test_recorded"


def test_a_key_that_changed_has_another_solver_version() -> None:
    """Else a campaign that is half done would begin again."""
    recorded = json.loads(RECORDED.read_text("utf-8"))
    assert recorded["solver_version"] == SOLVER_VERSION, "run python -m tests.study.plan.test_recorded"
    assert {label: task.key for label, task in NAMED.items()} == recorded["keys"]


def record_anew() -> None:
    """Write what the solver gives now."""
    content = {
        "solver_version": SOLVER_VERSION,
        "keys": {label: task.key for label, task in NAMED.items()},
        "results": {label: computed(label) for label in TASKS},
    }
    RECORDED.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    record_anew()
