"""Whatever can be written in a manifest is refused in words, or ends in results that obey the contact's laws or say why not.

Scenes are drawn from far beyond what is sensible; small grids and limits let thousands of them take a minute.
"""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings

from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.kinds import column
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.run.compute import compliance_of, run_task
from tests.hard_cases.scenery import scenes
from tests.physics import assert_contact_laws, assert_friction_law

LONGEST = 60.0
"""Seconds after which a scene counts as one that never ends: limits on slips, events and segments keep all below a few."""
OPEN = ("gap", "restick_time", "restick_position")
"""What may be infinite or missing: nodes beyond a punch's edges have no pin above them, a last slip may not have ended."""


REPEATED = ("stick_slip_period", "spring_force_amplitude", "spring_force_range")
"""What a drive has only where its second half is long enough to show it."""
SHARES = ("fluctuation", "unseen_force")
"""What is over the force of a plateau, which may be 0."""
LACKS = {
    Ending.NO_PLATEAU: (
        "plateau_mean",
        "plateau_std",
        "plateau_start",
        "plateau_end",
        "plateau_spacings",
        "plateau_peak",
        "mean_step",
        "mean_slips",
        "mean_drop",
        "kinetic_friction",
    ),
    Ending.NO_SLIP: ("static_friction", "kinetic_friction"),
}
"""Numbers that an outcome says are missing; a record without any event has no means over events either."""


def check(text: str, folder: Path) -> str:
    """Run a scene and hold it to the laws; returns how it ended."""
    path = folder / "scene.toml"
    path.write_text(text)
    try:
        plan = make_plan(load_manifest(path))
    except ManifestError as error:
        return "refused" if str(path) in str(error) else f"refused without saying where: {error}"
    results: dict[str, TaskResult] = {}
    for task in plan.tasks:
        result = results[task.key] = run_task(task, results)
        assert result.outcome.ok or result.outcome.message, task.kind
        assert result.outcome.ending is not Ending.CRASHED
        if result.outcome.usable and result.scalars:
            _assert_finite(result)
        first = next(iter(result.members), result.outcome)  # an ensemble is usable without its first member
        if task.kind == "record" and first.usable:
            assert task.case is not None
            compliance = compliance_of(task, results)
            case = task.ensemble.case(task.case, 0)
            record, end = slide_to_state(case, compliance)
            np.testing.assert_array_equal(record.force_after, column(result, "force_after", "event"))
            assert np.all(np.diff(record.displacement) > 0.0)
            assert_friction_law(case, record, compliance)
            if case.effects.pin_translation:  # else it is carried along in thought only
                assert_contact_laws(end, case, compliance if case.effects.coupling else compliance.uncoupled())
    if not results:
        return str(plan.cases[0].outcome.ending)
    return str(results[plan.tasks[-1].key].outcome.ending)


def _assert_finite(result: TaskResult) -> None:
    for name, array in result.arrays.items():
        assert name in OPEN or np.all(np.isfinite(array)), (result.kind, name)
    members = len(next(iter(result.scalars.values())))
    for member, outcome in enumerate(result.members or [result.outcome] * members):
        inertia = ("static_friction",) if "is inertia and damper" in outcome.message else ()
        lacking = (*REPEATED, *SHARES, *LACKS.get(outcome.ending, ()), *inertia)
        refused = not outcome.ok and all(math.isnan(numbers[member]) for numbers in result.scalars.values())
        for name, numbers in result.scalars.items() if outcome.usable and not refused else ():
            missing = name.startswith("fit") or name.endswith("_excess") or name in lacking  # a fit needs slips
            assert missing or not math.isnan(numbers[member]), (result.kind, name)


@pytest.mark.parametrize(
    ("count", "part"), [(100, 0), *(pytest.param(1250, part, marks=pytest.mark.slow) for part in range(1, 9))]
)
def test_every_scene_ends_in_a_lawful_result_or_a_named_refusal(count, part, tmp_path):
    """The same scenes every time; in parts, which several processes try at once."""
    endings: dict[str, int] = {}

    # Nothing is shrunk: the scene that fails is small as it is, and thousands of tries for a smaller one are not.
    @seed(part)
    @settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(scenes())
    def every(text: str) -> None:
        start = time.monotonic()
        ending = check(text, tmp_path)
        endings[ending] = endings.get(ending, 0) + 1
        assert time.monotonic() - start < LONGEST

    every()
    assert set(endings) <= {"refused", *Ending}
    print(", ".join(f"{ending}: {number}" for ending, number in sorted(endings.items())))
    whole = sum(endings.get(ending, 0) for ending in (Ending.COMPLETED, Ending.NO_PLATEAU, Ending.NO_SLIP))
    assert whole > count // 10  # the scenes are no mere nonsense
