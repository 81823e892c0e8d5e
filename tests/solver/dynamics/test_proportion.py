"""A drive in N/m, m/s and s is told by its size from a dimensionless one; no drive of a shipped campaign is taken for one."""

import itertools
from dataclasses import replace

import pytest

import nanoslip
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.integrators import LEAST_TRAVEL, STIFFEST, disproportion
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.shipped import campaigns

K, F = 0.4, 1.5e-4
"""Stiffness and friction force of the paper's contact."""
CASE = nanoslip.Case(intrinsic_friction=0.5, radius=50.0, slab=nanoslip.Slab(n_x=17), max_events=200)
MACHINES = {
    "the paper's": (2e5, 2e-3, 0.2),
    "a soft one": (1e4, 1e-4, 10.0),
    "a stiff one": (1e8, 1e-2, 0.05),
    "a force microscope": (1.0, 1e-6, 1e-2),
}
"""Spring (N/m), velocity (m/s), duration (s)."""


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
def test_values_in_si_are_told_by_their_size(machine: tuple[float, float, float]) -> None:
    spring, velocity, duration = machine
    drive = Drive(spring, 0.1, velocity, duration)
    said = disproportion(drive, K, F)
    assert f"spring_stiffness={spring:g}, stage_velocity={velocity:g}, duration={duration:g})" in said
    assert "Drive.from_si(Scales(" in said


def test_drives_of_shipped_campaigns_are_in_proportion() -> None:
    """On contacts ten times as stiff or as soft as the paper's, and at its lightest and heaviest loads in the maps."""
    seen = 0
    for path in campaigns().values():
        manifest = load_manifest(path)
        for each in manifest.drives if "dynamics" in manifest.stages else ():
            assert each.drive is not None
            drive = each.drive.dimensionless(manifest.scales)
            for stiffness, force in itertools.product((0.1 * K, K, 10.0 * K), (0.1 * F, F, 10.0 * F)):
                assert disproportion(drive, stiffness, force) == "", (path.stem, each.label)
            seen += 1
    assert seen > 100


def test_a_campaign_is_asked_nothing_as_its_drives_are_in_si() -> None:
    """Hard cases and random scenes pull pins by springs as stiff as can be written down."""
    drive = {"name": "rigid", "spring_stiffness": 1e12, "stage_velocity": 1e-6, "samples": 10}
    alone = {"limits": {"events": 60}, "ensemble": {"members": 1}}
    found = nanoslip.run({"title": "stiff", "numerics": {"n_x": 17}, "drives": [drive], **alone})
    assert found.spring_stiffness == 1e12  # and no warning, which would be an error here


def test_the_bounds_are_where_they_are_said_to_be() -> None:
    drive = Drive(STIFFEST * K, 0.1, 1.0, 1.0)
    assert disproportion(drive, K, F) == ""
    assert "is 1.1e+03 times the contact's stiffness" in disproportion(
        replace(drive, spring_stiffness=1.1 * STIFFEST * K), K, F
    )
    needed = F * (1.0 / K + 1.0 / K)
    slow = Drive(K, 0.1, LEAST_TRAVEL * needed, 1.0)
    assert disproportion(slow, K, F) == ""
    assert "is 0.009 of what makes the pin slide" in disproportion(replace(slow, duration=0.9), K, F)
    assert disproportion(replace(slow, stage_velocity=0.0), K, F) == ""  # a pin at rest is a question, too


def test_a_drive_in_si_is_warned_of_once_and_computed_all_the_same() -> None:
    record = nanoslip.friction_record(CASE)
    with pytest.warns(
        UserWarning, match=r"^spring_stiffness = 200000 is .* times the contact's stiffness: .*from_si"
    ) as seen:
        nanoslip.drive_result(CASE, nanoslip.Drive(2e5, 0.1, 2e-3, 0.2), record)
    assert len(seen) == 1
    assert seen[0].filename == __file__
    nanoslip.drive_result(CASE, nanoslip.Drive.from_si(Scales()), record)  # warnings are errors here
