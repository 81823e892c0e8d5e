"""A pin sticks below its critical velocity, and slides above, over the same record."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pint
import pytest

import nanoslip
from nanoslip.solver.dynamics.critical import RESOLUTION, STRIDE, STRIDES, boundary, critical_velocity
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.regime import SEARCHES, count_sticks
from nanoslip.solver.ensemble import student
from nanoslip.solver.sliding.plateau import extreme_error, repetition_error, teeth
from nanoslip.study.dataset.variables import missing_error_reasons
from nanoslip.study.tasks.drive import REPEATED
from tests.conftest import Main

CASE = nanoslip.Case(radius=50.0, slab=nanoslip.Slab(n_x=65), max_presliding=4.0)


@pytest.mark.parametrize("first", [1.1, 1.9, 700.0, 5e3])
def test_a_boundary_is_the_uppermost_to_its_resolution(first: float) -> None:
    """Whatever lies below it, where the pin may slide in windows, and whatever the first drive is."""
    found = boundary(lambda value: value < 0.1 or 0.3 < value < 1.0 or value == first > 2.0, first)
    assert found.search == "found"
    assert 1.0 / RESOLUTION < found.value < RESOLUTION


def test_what_never_changes_or_fails_has_no_boundary() -> None:
    """A pin that sticks at all velocities is told from one that never sticks, and from one of which nothing is known."""
    asked: list[float] = []
    found = [boundary(lambda value: bool(asked.append(value)), 1.0)]
    assert (len(asked), min(asked)) == (STRIDES + 1, STRIDE**-STRIDES)
    found += [
        boundary(lambda value: None if value < 0.5 else False, 1.0),
        boundary(lambda value: True, 1.0),
    ]
    found.append(boundary(lambda value: value < 1.0, math.inf))  # without a damper
    found.append(boundary({1.0: False, 0.5: True}.get, 1.0))  # fails between both
    assert all(math.isnan(each.value) for each in found)
    assert [each.search for each in found] == ["never_sticks", "unknown", "always_sticks", "unknown", "unknown"]


@pytest.mark.everyday(1)
@pytest.mark.parametrize("scale", [1e-2, 30.0])
def test_the_critical_velocity_does_not_depend_on_the_drives_own(scale: float) -> None:
    """It is the starting point of nothing."""
    record = nanoslip.friction_record(CASE)
    plateau, drive = nanoslip.plateau_of(record), nanoslip.Drive.from_si(spring_stiffness=3e6)
    faster = replace(drive, stage_velocity=scale * drive.stage_velocity)
    found = critical_velocity(record, plateau, drive)
    assert critical_velocity(record, plateau, faster) == found
    assert found.critical_velocity > 0.0


def test_beyond_the_critical_velocity_a_pin_slides_and_before_it_sticks() -> None:
    record = nanoslip.friction_record(CASE)
    plateau, drive = nanoslip.plateau_of(record), nanoslip.Drive.from_si(spring_stiffness=3e6)
    found = critical_velocity(record, plateau, drive)
    regimes = []
    for factor in (2.0 ** (-1.0 / 128.0), 2.0):  # the lower end of the last bracket, and far above
        pulled = replace(drive, stage_velocity=found.critical_velocity * factor)
        motion = replace(
            measure_motion(record, plateau, pulled)[0], forgotten_from=0.0
        )  # its own, so near to the border
        regimes.append(count_sticks(motion, pulled).regime)
    assert regimes[0] == "stick_slip"
    assert regimes[1] in ("slides", "micro_slip")


CAMPAIGN: dict[str, Any] = {
    "title": "x",
    "stages": ["contact", "slip", "dynamics"],
    "constants": {"radius": 50.0},
    "numerics": {"n_x": 17},
    "limits": {"spacings": 2.2},
    "ensemble": {"members": 2},
    "drives": [{"name": "own", "spring_stiffness": 3e6, "samples": 1}],
    "outputs": {"fit": False},
}


def test_a_campaign_has_it_on_request_of_each_member_in_si() -> None:
    without = nanoslip.run(CAMPAIGN)
    found = nanoslip.run({**CAMPAIGN, "outputs": {"fit": False, "critical": True}})
    assert "critical_velocity" not in without
    assert found.static_friction.identical(without.static_friction)
    each = found.nanoslip.tree["drive_ensemble"].critical_velocity.values
    assert found.critical_velocity.item() == pytest.approx(each.mean())
    assert found.critical_velocity_uncertainty.item() > found.critical_velocity_shared_error.item() >= 0.0
    assert (found.critical_velocity_search.item(), found.critical_velocity_search_found_members.item()) == ("found", 2)
    assert found.critical_velocity_search.item() in SEARCHES
    drive = {**CAMPAIGN["drives"][0], "stage_velocity": 1.05 * each.max()}
    faster = nanoslip.run({**CAMPAIGN, "drives": [drive]})
    assert faster.regime.item() == "slides"


def test_of_a_short_record_it_has_no_error_and_of_a_longer_one_what_its_later_half_adds() -> None:
    """Longer records have higher peaks: all starts of a short one are below, by 20 % where ± from starts was 0.5 %."""
    record = nanoslip.friction_record(replace(CASE, max_presliding=None, max_events=None, max_spacings=1.0))
    half = record.first_half
    assert half.final_displacement == 0.5 * record.final_displacement
    assert half.final_force == pytest.approx(
        float(teeth(record).force(np.array([half.final_displacement]))[0]), rel=1e-9
    )
    assert half.highest_force == record.force_before[: len(half.displacement)].max() <= record.highest_force
    assert extreme_error([0.2, 0.4]) == pytest.approx(0.3 * student(2))
    assert math.isnan(extreme_error([0.2]))
    short = nanoslip.run({**CAMPAIGN, "limits": {"presliding": 4}, "outputs": {"fit": False, "critical": True}})
    assert np.isnan(short.critical_velocity_uncertainty.item())
    assert "records shorter than two node spacings" in missing_error_reasons(short.squeeze(), ["critical_velocity"])
    assert short.peak_friction_uncertainty.item() > short.peak_friction_shared_error.item() >= 0.0


def test_numbers_of_a_repeated_record_have_the_error_of_its_length() -> None:
    """A pin locks to the pattern of a record as it is repeated, alike from all starts: half of the record has another pattern."""
    assert repetition_error([0.2, 0.4]) == pytest.approx(student(2) * math.sqrt(0.3**2 - 0.1**2))
    drives = [
        {**CAMPAIGN["drives"][0], "name": name, "stage_velocity": speed}
        for name, speed in (("fast", 1e-3), ("slow", 1e-4))
    ]
    found = nanoslip.run({**CAMPAIGN, "ensemble": {"members": 6}, "drives": drives}).squeeze()
    assert set(found.regime.values) == {"stick_slip"}
    goes_beyond = found.stage_velocity * found.end_time > 1e-3 * found.plateau_end
    assert goes_beyond.sel(drive=["fast", "slow"]).values.tolist() == [True, False]
    for name in REPEATED:
        own, shared = found[f"{name}_uncertainty"], found[f"{name}_shared_error"]
        assert (own > shared).all()
        assert shared.sel(drive="slow") == 0.0
    assert found.time_stuck_shared_error.sel(drive="fast") > 0.0
    assert found.spring_force_amplitude_shared_error.sel(drive="fast") > 0.0


def test_numbers_of_a_stage_to_and_fro_have_the_error_of_the_record_that_it_repeats() -> None:
    """Each leg goes on along the same record; over the contact itself it meets none twice."""
    drive = {**CAMPAIGN["drives"][0], "stage_velocity": 1e-3, "stage_stroke": "0.05 mm", "stage_cycles": 3}
    drive.pop("duration", None)
    drives = [{**drive, "name": name, "memory": memory} for name, memory in (("record", False), ("contact", True))]
    found = nanoslip.run({**CAMPAIGN, "ensemble": {"members": 3}, "drives": drives}).squeeze()
    for name in ("damper_energy", "sliding_stroke"):
        own, shared = found[f"{name}_uncertainty"], found[f"{name}_shared_error"]
        assert (own > shared).all()
        assert shared.sel(drive="record") > 0.0
        assert shared.sel(drive="contact") == 0.0


def test_a_pin_over_its_contact_repeats_no_record() -> None:
    """With `memory` the length of the record decides nothing: a short one leaves ± as it is."""
    drive = {**CAMPAIGN["drives"][0], "stage_velocity": 1e-3, "duration": 0.25}
    short = {**CAMPAIGN, "limits": {"presliding": 4}}
    found, repeating = (nanoslip.run({**short, "drives": [{**drive, "memory": memory}]}) for memory in (True, False))
    for name in REPEATED:
        assert found[f"{name}_uncertainty"].item() > 0.0
        assert found[f"{name}_shared_error"].item() == 0.0
    assert np.isnan(repeating.time_stuck_uncertainty.item())


@pytest.mark.slow
def test_try_states_the_critical_velocity_with_its_unit(main: Main) -> None:
    words = ("radius=50", "n_x=17", "spacings=2.2", "members=2", "spring_stiffness=3e6", "samples=1", "fit=false")
    code, text, _ = main("try", *words, "--critical")
    stated = re.match(r"no stick-slip above stage velocity (\S+) ± \S+ ([\w/]+)", text)
    assert code == 0
    assert stated
    velocity = pint.Quantity(float(stated[1]), stated[2]).to("m/s").magnitude
    found = nanoslip.run({**CAMPAIGN, "outputs": {"fit": False, "critical": True}})
    rounding = found.critical_velocity_uncertainty.item()  # no digit is stated below it
    assert velocity == pytest.approx(found.critical_velocity.item(), abs=rounding)
    assert main("try", "--critical", "--contact")[0] == 2
