"""A task is named by what decides its result, and its result is the solver's, refusals included."""

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solver.case import Case, SlipRule
from solver.contact.initial import initial_contact
from solver.drive import Drive, Scales
from solver.dynamics.regime import REGIMES
from solver.elasticity.compliance import surface_compliance
from solver.elasticity.schemes import Galerkin
from solver.outcome import Ending
from solver.slab import Slab
from solver.sliding.events import slide
from study.manifest.drives import NamedDrive
from study.plan.tasks import (
    Task,
    TaskResult,
    compliance_task,
    contact_task,
    drive_task,
    record_scalars_task,
    record_task,
    run_task,
    states_task,
)

CASE = Case(radius=50.0, slab=Slab(33), max_events=300)
DRIVE = NamedDrive.of("paper", samples=50).dimensionless(Scales())


def run(*tasks: Task) -> TaskResult:
    """The result of the last task, the others being what it needs."""
    results: dict[str, TaskResult] = {}
    for task in tasks:
        results[task.key] = run_task(task, {key: results[key] for key in task.needs})
    return results[tasks[-1].key]


def slid(case: Case) -> TaskResult:
    return run(compliance_task(case.slab), record_task(case))


def drive(case: Case, drive: Drive = DRIVE) -> TaskResult:
    return run(compliance_task(case.slab), record_task(case), drive_task(case, drive))


def test_a_compliance_is_known_by_its_slab_alone() -> None:
    other = replace(CASE, intrinsic_friction=0.1, radius=9.0, slip_rule=SlipRule(residual_shear=0.5))
    assert record_task(other).needs == record_task(CASE).needs == (compliance_task(Slab(33)).key,)
    assert compliance_task(Slab(33, poisson=0.3)).key != compliance_task(Slab(33)).key
    assert (
        compliance_task(Slab(33, scheme=Galerkin(rows_per_level=2))).key == compliance_task(Slab(33)).key
    )  # the default


def test_a_friction_record_is_known_without_the_drive() -> None:
    faster = replace(DRIVE, stage_velocity=2 * DRIVE.stage_velocity)
    assert drive_task(CASE, faster).needs == drive_task(CASE, DRIVE).needs == (record_task(CASE).key,)
    assert drive_task(CASE, faster).key != drive_task(CASE, DRIVE).key


@pytest.mark.parametrize(
    "other",
    [
        replace(CASE, intrinsic_friction=0.4), replace(CASE, radius=51.0), replace(CASE, normal_load=2e-3),
        replace(CASE, slab=Slab(17)), replace(CASE, pin="flat_punch"), replace(CASE, initial_contact="gradual"),
        replace(CASE, slip_rule=SlipRule(residual_shear=0.5)), replace(CASE, max_events=301),
        replace(CASE, max_displacement=1.0), replace(CASE, max_spacings=4.0), replace(CASE, start=0.5),
    ],
)  # fmt: skip
def test_all_that_decides_a_record_is_in_its_key(other: Case) -> None:
    assert record_task(other).key != record_task(CASE).key


def test_a_limit_in_spacings_is_known_by_its_displacement() -> None:
    """The same place said in other words is the same task; of two limits, only the nearer decides."""
    there = replace(CASE, max_displacement=4.0 / 32.0)
    for other in (
        replace(CASE, max_spacings=4.0),
        replace(CASE, max_spacings=4.0, max_displacement=1.0),
        replace(CASE, max_spacings=7.0, max_displacement=4.0 / 32.0),
    ):
        assert record_task(other).key == record_task(there).key
        assert drive_task(other, DRIVE).key == drive_task(there, DRIVE).key
    assert record_task(replace(CASE, max_spacings=4.5)).key != record_task(there).key
    # Initial contact comes before any limit, and knows where the pin starts.
    assert contact_task(there).key == contact_task(CASE).key != contact_task(replace(CASE, start=0.5)).key


def test_what_a_pin_does_not_have_is_not_in_its_key() -> None:
    punch = replace(CASE, pin="flat_punch")
    assert record_task(replace(CASE, half_width=0.1)).key == record_task(CASE).key
    assert record_task(replace(punch, radius=1.0)).key == record_task(punch).key
    assert record_task(replace(punch, half_width=0.1)).key != record_task(punch).key


def test_the_limits_of_a_run_do_not_change_first_touch() -> None:
    assert contact_task(replace(CASE, max_events=1)).key == contact_task(CASE).key
    assert contact_task(CASE).key != record_task(CASE).key


def test_scales_matter_to_a_drive_by_its_dimensionless_numbers_only() -> None:
    """Four times the modulus, spring and mass: the same numbers (all factors are powers of two, exact in binary)."""
    stiff = NamedDrive.of("stiff", pin_mass=2.0, spring_stiffness=8e5, samples=50)
    assert drive_task(CASE, stiff.dimensionless(Scales(shear_modulus=4e10))).key == drive_task(CASE, DRIVE).key


@pytest.mark.parametrize(
    "effect",
    [{"surface_compliance": False}, {"reverse_motion": False}, {"profile": "mean"}, {"damping_ratio": 0.0}],
    ids=str,
)
def test_an_effect_of_a_drive_is_in_its_key_and_leaves_its_record_alone(effect: dict[str, Any]) -> None:
    other = replace(DRIVE, **effect)
    assert drive_task(CASE, other).key != drive_task(CASE, DRIVE).key
    assert drive_task(CASE, other).needs == drive_task(CASE, DRIVE).needs
    result = drive(CASE, other)
    assert result.outcome.ok
    # Small effects here, but for the mean: without static excess the first slip needs 18 % less.
    assert result.scalars["static_friction"] == pytest.approx(drive(CASE).scalars["static_friction"], rel=0.2)


def test_tasks_and_results_travel_between_processes() -> None:
    task = drive_task(CASE, DRIVE)
    assert pickle.loads(pickle.dumps(task)) == task
    result = slid(CASE)
    copy = pickle.loads(pickle.dumps(result))
    assert (copy.key, copy.outcome, copy.scalars) == (result.key, result.outcome, result.scalars)
    np.testing.assert_array_equal(copy.arrays["displacement"], result.arrays["displacement"])


def test_a_rank_that_computes_imports_nothing_heavy() -> None:
    heavy = ("xarray", "matplotlib", "scipy.interpolate")
    command = f"import sys, study.plan.tasks; print([m for m in {heavy} if m in sys.modules])"
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == "[]"


def test_a_compliance_result_is_the_solvers_matrix() -> None:
    np.testing.assert_array_equal(run(compliance_task(Slab(17))).arrays["matrix"], surface_compliance(Slab(17)).matrix)


def test_a_contact_result_is_the_solvers_state() -> None:
    state = initial_contact(CASE, surface_compliance(CASE.slab))
    result = run(compliance_task(CASE.slab), contact_task(CASE))
    assert result.outcome.ok
    assert result.scalars["contact_size"] == state.contact.sum() > 2
    assert result.scalars["approach"] == state.approach
    assert result.scalars["slips"] == state.slips
    assert result.scalars["maximum_pressure"] == state.pressure.max()
    for name in ("pressure", "shear", "slip", "gap"):
        np.testing.assert_array_equal(result.arrays[name], getattr(state, name))


def test_a_friction_result_holds_the_whole_record() -> None:
    record = slide(CASE, surface_compliance(CASE.slab))
    result = slid(CASE)
    for name in ("displacement", "force_before", "force_after", "kind", "slips"):
        np.testing.assert_array_equal(result.arrays[name], getattr(record, name))
    scalars = result.scalars
    assert scalars["events"] == 300 == scalars["slips"] + scalars["releases"] + scalars["touches"]
    assert scalars["mean_step"] == pytest.approx(record.displacement[-1] / 300, rel=1e-15)
    assert scalars["surface_stiffness"] == record.initial_stiffness
    assert scalars["peak_friction"] == record.force_before.max() / CASE.normal_load
    assert scalars["plateau_start"] < scalars["plateau_end"] <= scalars["final_displacement"]
    assert scalars["cascade_slips"] == record.slips.sum() > scalars["slips"]
    assert 0.0 < scalars["plateau_mean"] < scalars["peak_friction"] < CASE.intrinsic_friction


def test_a_record_without_a_plateau_says_so_and_is_kept() -> None:
    """Its outcome can be filtered; its numbers, but for the plateau's, are as good as any record's."""
    result = slid(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert "raise limits.events" in result.outcome.message
    missing = {name for name, number in result.scalars.items() if np.isnan(number)}
    assert missing == {name for name in result.scalars if name.startswith("plateau_")} | {
        "mean_step_uncertainty", "mean_drop_uncertainty",
    }  # fmt: skip
    assert result.scalars["events"] == len(result.arrays["displacement"]) == 5


def test_a_record_without_a_plateau_stands_in_the_way_of_drives_alone() -> None:
    short = replace(CASE, max_events=5)
    record = slid(short)
    scalars = record_scalars_task(record_task(short))
    copied = run_task(scalars, {scalars.needs[0]: record})
    assert (copied.outcome, copied.scalars) == (record.outcome, record.scalars)
    assert run(compliance_task(short.slab), states_task(short, (5,), False)).outcome.ok


def test_a_drive_over_a_record_without_a_plateau_says_so() -> None:
    result = drive(replace(CASE, max_events=5))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert result.outcome.message.startswith("the friction record has none to repeat: 5 events")
    assert not result.scalars


def test_what_needs_a_failed_result_fails_with_its_reason() -> None:
    """With one slip allowed per event a cascade is given up, and there is no record to drive over."""
    hasty = replace(CASE, slip_rule=SlipRule(cascade_limit=1))
    record = slid(hasty)
    result = drive(hasty)
    assert record.outcome.ending is Ending.CASCADE_LIMIT
    assert result.outcome.ending is Ending.NEEDS_FAILED
    assert result.outcome.message == f"its record ended as cascade_limit: {record.outcome.message}"
    assert not result.arrays


def test_the_spring_pulls_as_far_as_the_stage_is_ahead() -> None:
    """Spring force = k(Vt - x) at every sample, to rounding of the stage's position."""
    result = drive(CASE)
    arrays = result.arrays
    stage = DRIVE.stage_velocity * arrays["time"]
    assert result.outcome.ok
    assert arrays["time"].shape == (51,)
    assert arrays["time"][-1] == pytest.approx(DRIVE.duration, rel=1e-15)
    np.testing.assert_allclose(
        arrays["spring_force"], DRIVE.spring_stiffness * (stage - arrays["position"]), atol=1e-15 * stage[-1]
    )


def test_a_drive_measures_its_friction() -> None:
    """μ_s is at most the record's peak, μ_k the plateau within five uncertainties, and the fit finds both again.

    To a mean drop of the record: the closed form has no teeth, and where on one a slip begins is not its to know.
    """
    record, result = slid(CASE), drive(CASE)
    measured, plateau = result.scalars, record.scalars["plateau_mean"]
    assert measured["macroscopic_slips"] == len(result.arrays["slip_time"]) >= 1
    assert measured["kinetic_friction"] == pytest.approx(plateau, abs=5 * measured["kinetic_friction_uncertainty"])
    assert plateau < measured["static_friction"] < 1.01 * record.scalars["peak_friction"]
    tooth = record.scalars["mean_drop"]
    assert measured["fitted_static_friction"] == pytest.approx(measured["static_friction"], abs=tooth)
    assert measured["fitted_kinetic_friction"] == pytest.approx(measured["kinetic_friction"], abs=tooth)


def test_a_drive_too_short_to_slip_says_so_and_keeps_its_motion() -> None:
    result = drive(CASE, replace(DRIVE, duration=0.01 * DRIVE.duration))
    assert result.outcome.ending is Ending.NO_SLIP
    assert "raise the drive's duration" in result.outcome.message
    assert np.isnan(result.scalars["static_friction"])
    assert np.isfinite(result.arrays["position"]).all()
    assert (result.scalars["macroscopic_slips"], result.scalars["resticks"], result.scalars["time_stuck"]) == (
        0,
        0,
        1.0,
    )
    assert REGIMES[int(result.scalars["regime"])] == "sticks"


def test_a_drive_that_ends_amid_its_oscillations_has_no_plateau_of_the_driving_force() -> None:
    """At 45 ms the pin has just begun to slip: μ_s is known, μ_k is not."""
    result = drive(CASE, replace(DRIVE, duration=0.45 * DRIVE.duration))
    assert result.outcome.ending is Ending.NO_PLATEAU
    assert result.outcome.message.startswith("the driving force ")
    assert result.scalars["static_friction"] > 0.0
    assert np.isnan(result.scalars["kinetic_friction"])


def test_what_a_drive_does_is_counted_from_its_slips() -> None:
    result = drive(CASE)
    slips, ends = result.arrays["slip_time"], result.arrays["restick_time"]
    ended = np.isfinite(ends)
    assert result.scalars["resticks"] == ended.sum()
    stuck = 1.0 - np.sum(np.where(ended, ends, DRIVE.duration) - slips) / DRIVE.duration
    assert result.scalars["time_stuck"] == pytest.approx(stuck, rel=1e-12)
    assert REGIMES[int(result.scalars["regime"])] == "slides"  # as the paper's: it slides through the last half


def test_a_drive_knows_nothing_that_its_record_forgot() -> None:
    """The record is rebuilt from its result: through the store's numbers, the drive is the same bit for bit."""
    record = slid(CASE)
    copy = replace(record, arrays={name: array.copy() for name, array in record.arrays.items()})
    task = drive_task(CASE, DRIVE)
    first, second = (run_task(task, {task.needs[0]: need}) for need in (record, copy))
    np.testing.assert_array_equal(first.arrays["position"], second.arrays["position"])
