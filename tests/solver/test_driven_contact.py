"""A pin that is pulled over its contact: the record where it never turns, laws and energy where it does, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, Interface, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.drive import Drive
from nanoslip.solver.driven import contact_drive
from nanoslip.solver.driven.contact_drive import driven_contact, pull_of_contact
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.dynamics.friction_limit import make_friction_limit
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.simulate import drive_result, friction_record
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from tests.physics import LIMITS, law_errors, stored_energy

W = 1e-3


def case_of(scheme="half_plane", n_x=33, **changes):
    return Case(slab=Slab(n_x=n_x, scheme=scheme), **changes)


def pulled(case, **drive):
    """The case pulled by a drive in SI: its motion, and the contact at the end."""
    compliance, seen = surface_compliance(case.slab), []
    drive = Drive.from_si(**{"memory": True, **drive})

    def follow(motion):
        seen.append(driven_contact(case, compliance, drive, motion))
        return seen[-1].run, seen[-1].outcome

    record = slide(case, compliance)
    motion = integrate(
        make_friction_limit(record, plateau_of(record), "sawtooth"), drive, record.initial_stiffness, follow
    )
    return drive, motion, seen[-1]


ONE_WAY = {"duration": 0.3, "damping_ratio": 40.0, "stage_velocity": 2e-4, "spring_stiffness": 5e5}


@pytest.mark.parametrize("scheme", ["half_plane", pytest.param("galerkin", marks=pytest.mark.slow)])
def test_a_pin_that_never_turns_meets_its_record(scheme):
    """The shortcut over the record is exact where its contact is stiffer than every tooth: then F is F̃ from the start on."""
    case = case_of(scheme, 65, start=0.35, initial_contact="frictionless", max_events=None, max_displacement=0.05)
    record = slide(case, surface_compliance(case.slab))
    limit = make_friction_limit(record, plateau_of(record), "sawtooth")
    stiffest = 1.001 * max(float(limit.slope.max()), record.initial_stiffness)
    over_record = integrate(limit, Drive.from_si(**ONE_WAY), stiffest)
    drive = Drive.from_si(**ONE_WAY, memory=True)
    over_contact = integrate(limit, drive, stiffest, pull_of_contact(case, surface_compliance(case.slab), drive))
    assert over_contact.outcome.ok
    assert over_record.position[-1] > 5 * record.presliding_length
    np.testing.assert_allclose(over_contact.position, over_record.position, atol=1e-12 * over_record.position[-1])
    np.testing.assert_allclose(over_contact.friction_force, over_record.friction_force, atol=1e-10 * W)
    assert over_contact.friction_work == pytest.approx(over_record.friction_work, rel=1e-12)
    assert over_contact.spring_force_range == pytest.approx(over_record.spring_force_range, rel=1e-10)


SWINGING = {"duration": 0.1, "damping_ratio": 0.02, "stage_velocity": 5e-3}
"""A light damper: the pin swings back after every slip."""


@pytest.mark.parametrize(
    "case",
    [
        case_of("strip"),
        case_of("galerkin", radius=50.0),
        pytest.param(case_of("half_plane", 65, intrinsic_friction=0.9), marks=pytest.mark.slow),
        pytest.param(case_of("galerkin", 65, slip_rule=SlipRule("simultaneous")), marks=pytest.mark.slow),
    ],
    ids=lambda case: case.slab.scheme.name,
)
def test_energy_is_neither_made_nor_lost_over_many_turns(case):
    """The work against friction is stored in the slab, done by the sinking load, or lost in events; the laws hold at the end."""
    drive, motion, found = pulled(case, **SWINGING)
    assert motion.outcome.ok
    assert (np.diff(np.sign(motion.velocity)) != 0.0).sum() > 10
    assert found.events > 100
    start = initial_contact(case, surface_compliance(case.slab))
    kept = stored_energy(found.end) - stored_energy(start) - case.normal_load * (found.end.approach - start.approach)
    rounding = 1e-13 * stored_energy(found.end)
    assert motion.friction_work == pytest.approx(kept + found.lost, rel=1e-12, abs=rounding)
    stretch = drive.stage_velocity * motion.end_time - motion.position[-1]
    assert found.end.displacement == pytest.approx(motion.position[-1], abs=1e-12)
    assert motion.spring_force[-1] == pytest.approx(drive.spring_stiffness * stretch)
    errors = law_errors(found.end, case, surface_compliance(case.slab))
    assert {law for law, error in errors.items() if not error <= LIMITS[law]} == set()


def test_windows_do_not_matter(monkeypatch):
    """Windows of a rough pin that swings follow it both ways: as on the whole surface."""
    xi = np.linspace(-0.3, 0.3, 61)
    rough = tuple(zip(xi.tolist(), (2e-5 * np.cos(400.0 * xi**2)).tolist(), strict=True))
    case = case_of("galerkin", 65, heterogeneity=Heterogeneity(roughness=rough), radius=50.0)
    short = {**SWINGING, "duration": 0.04}  # of thousands of events rounding would part the last ones
    _, motion, found = pulled(case, **short)
    assert found.events > 500
    within = contact_drive._Contact

    def on_all(*scene):
        return within(*scene[:-1], True)

    monkeypatch.setattr(contact_drive, "_Contact", on_all)
    _, whole, _ = pulled(case, **short)
    np.testing.assert_allclose(motion.position, whole.position, atol=1e-9 * whole.position[-1])


def test_coefficients_are_those_of_the_contact():
    case = case_of("strip", 65, radius=50.0, max_events=None, max_presliding=8.0)
    record, si = friction_record(case), {"duration": 0.1}
    remembering = drive_result(case, Drive.from_si(**si, memory=True), record).coefficients
    forgetting = drive_result(case, Drive.from_si(**si), record).coefficients
    assert remembering.outcome.ok
    assert remembering.kinetic_friction == pytest.approx(forgetting.kinetic_friction, rel=0.1)
    assert remembering.kinetic_friction != forgetting.kinetic_friction


def test_a_slab_that_ends_ends_the_drive():
    case = case_of("galerkin", radius=20.0)
    _, motion, _ = pulled(case, duration=0.4, stage_velocity=2e-3, damping_ratio=1.0)
    assert motion.outcome.ending is Ending.CONTACT_LOST
    assert 0.2 < np.nanmax(motion.position) < 0.6


def test_slips_may_end_a_drive():
    case = case_of("strip", radius=20.0)
    _, motion, _ = pulled(case, duration=None, max_slips=2)
    assert motion.outcome.ok
    assert np.isfinite(motion.restick_time).sum() == 2
    assert motion.end_time == pytest.approx(motion.restick_time[1])


def test_a_drive_may_need_more_segments_than_its_limit():
    _, motion, _ = pulled(case_of(), duration=0.1, step_limit=50)
    assert motion.outcome.ending is Ending.STEP_LIMIT


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"interface": Interface(contacts=2), "max_presliding": 2.0}, "contacts"),
        ({"effects": Effects(pin_translation=False)}, "pin_translation"),
        ({"slip_rule": SlipRule(residual_shear=1.0)}, "residual_shear"),
        ({"slip_rule": SlipRule(limited_shear="forward")}, "limited_shear"),
    ],
)
def test_contacts_that_cannot_be_followed_are_refused(changes, key):
    case = case_of(**changes)
    drive = Drive.from_si(duration=0.01, memory=True)
    record = slide(case_of(), surface_compliance(case.slab))
    with pytest.raises(InvalidInput) as refused:
        measure_motion(record, plateau_of(record), drive, pull_of_contact(case, surface_compliance(case.slab), drive))
    assert (refused.value.key, list(refused.value.beside)) == ("memory", [key])


@pytest.mark.parametrize(
    "setting",
    [
        {"profile": "mean"},
        {"surface_compliance": False},
        {"reverse_motion": False},
        {"integrator": RK4(1e-6)},
    ],
)
def test_settings_of_a_record_are_refused_with_memory(setting):
    with pytest.raises(InvalidInput) as refused:
        replace(Drive.from_si(), memory=True, **setting)
    assert (refused.value.key, list(refused.value.beside)) == ("memory", list(setting))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_drives_are_lawful_or_an_outcome(seed):
    """Any load, friction, spring, damper and speed: laws and energy hold at the end, or the outcome says what is wrong."""
    rng = np.random.default_rng(seed)
    for _ in range(25):
        scheme = str(rng.choice(["strip", "galerkin", "half_plane", "biquadratic"]))
        case = Case(
            slab=Slab(n_x=int(rng.choice([9, 17, 33])), scheme=scheme),
            radius=float(np.exp(rng.uniform(2.0, 6.0))),
            normal_load=float(np.exp(rng.uniform(-11.0, -5.0))),
            intrinsic_friction=float(np.exp(rng.uniform(-5.0, 0.5))),
            start=float(rng.uniform()),
            max_events=1000,
        )
        period = 2 * np.pi * np.sqrt(0.5 / (stiffness := float(np.exp(rng.uniform(9.0, 14.0)))))
        drive = {
            "spring_stiffness": stiffness,
            "damping_ratio": float(rng.choice([0.0, 0.1, 1.0, 20.0])),
            "stage_velocity": float(np.exp(rng.uniform(-10.0, -3.0))),
            "duration": float(rng.uniform(1.0, 6.0)) * period,
            "samples": 100,
            "step_limit": 20_000,
        }
        compliance = surface_compliance(case.slab)
        record = slide(case, compliance)
        if not (record.outcome.ok and plateau_of(record).outcome.ok):
            continue
        _, motion, found = pulled(case, **drive)
        if motion.outcome.ok:
            errors = law_errors(found.end, case, compliance)
            assert {law for law, error in errors.items() if not error <= LIMITS[law]} == set(), (seed, case, drive)
        else:
            assert motion.outcome.message
