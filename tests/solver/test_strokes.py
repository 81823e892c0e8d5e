"""A stage that goes to and fro: closed forms, an integrator of its own, and balances of energy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.closed_forms import MindlinLoops
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.driven.contact_drive import legs_pull_of_contact
from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.dynamics.to_and_fro import leg_teeth, measure_strokes
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide

CASE = Case.of({"radius": 50.0, "n_x": 33, "max_events": 600})


@pytest.fixture(scope="module")
def record():
    return slide(CASE, surface_compliance(CASE.slab))


def stroke_of(record, times, spring, **more):
    """A drive whose stroke is so many times what stretches spring and contact from one side to the other, in 3 cycles."""
    force, stiffness = plateau_of(record).mean * record.normal_load, record.initial_stiffness
    stretch = force * (1.0 / spring + 1.0 / stiffness)
    usual = {
        "damping_ratio": 0.0,
        "stage_velocity": 1e-5 * stretch,
        "profile": "mean",
        "samples": 4000,
        "stage_cycles": 3,
    }
    return Drive(spring_stiffness=spring, stage_stroke=4.0 * times * stretch, **{**usual, **more})


def friction_of(record):
    return plateau_of(record).mean * record.normal_load


def test_static_friction_after_a_turn_is_that_of_the_profile(record):
    """2 %: what a damper adds to the force of a slow stage."""
    found = measure_strokes(record, plateau_of(record), stroke_of(record, 2.0, 0.3, damping_ratio=1.0))
    assert found.loops.turn_static_friction == pytest.approx(friction_of(record), rel=2e-2)
    assert np.isfinite(found.legs.static_force).all()


@pytest.mark.parametrize(
    ("stiffness", "damping", "pull", "times"),
    [(0.22, 163.0, 0.48, 1.26), (0.44, 13.9, 0.64, 0.96), (0.01, 60.0, 2.5, 2.0)],
)
def test_a_pin_that_a_strong_damper_never_lets_stick_has_no_static_friction_at_turns(
    record, stiffness, damping, pull, times
):
    """c·V is `pull` times friction: the pin follows while its contact is unloaded, or moves at once at the turn.

    It was -0.6 and 1.6 times friction. Friction of single teeth differs by up to a tenth from the mean.
    """
    friction, spring = friction_of(record), stiffness * record.initial_stiffness
    velocity = pull * friction / (2.0 * damping * math.sqrt(spring))
    drive = stroke_of(
        record, times, spring, damping_ratio=damping, stage_velocity=velocity, profile="sawtooth", stage_cycles=5
    )
    forces = measure_strokes(record, plateau_of(record), drive).legs.static_force[2:]
    assert np.isnan(forces).any()
    known = forces[np.isfinite(forces)] / friction
    assert np.all((known >= 0.9) & (known <= 1.1)), known


def test_a_pin_that_follows_in_short_slips_is_no_pin_that_does_not_slide(record):
    """Without a damper a slow pin sticks in every oscillation, after a millionth of a presliding length."""
    loops = measure_strokes(record, plateau_of(record), stroke_of(record, 2.0, 0.3, stage_velocity=1e-7)).loops
    assert loops.leg_regime == "micro_slip"
    assert math.isnan(loops.turn_static_friction)


@pytest.mark.parametrize("steps", [1, 5])
def test_a_stage_that_fails_before_its_first_turn_is_an_outcome_without_motion(record, steps):
    found = measure_strokes(record, plateau_of(record), stroke_of(record, 2.0, 0.3, step_limit=steps))
    assert not found.outcome.ok
    assert not len(found.legs.direction)
    assert np.isnan(found.motion.spring_force).all()
    assert math.isnan(found.loops.loop_energy)


@pytest.mark.parametrize("motion", ["triangle", "sine"])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_the_loop_of_a_slow_stage_is_that_of_a_jenkins_element_in_series(record, motion, damping):
    """Loss 4F(A - F(1/k + 1/K)): what a slow drive adds is inertia, and a damper's force, both of the order of V."""
    drive = stroke_of(record, 2.0, 0.3, damping_ratio=damping, stage_motion=motion)
    if not damping:  # an oscillation that never ends takes time to follow
        drive = replace(drive, stage_velocity=10.0 * drive.stage_velocity)
    found = measure_strokes(record, plateau_of(record), drive)
    force, stiffness = friction_of(record), record.initial_stiffness
    stretch = force * (1.0 / drive.spring_stiffness + 1.0 / stiffness)
    loss = 4.0 * force * (0.5 * drive.stage_stroke - stretch)
    assert found.outcome.ok
    assert found.loops.contact_energy == pytest.approx(loss, rel=1e-3)
    assert found.loops.loop_energy == pytest.approx(loss, rel=1e-3)
    assert found.loops.sliding_stroke == pytest.approx(4.0 * stretch, rel=1e-12)
    assert found.loops.midstroke_friction == pytest.approx(force, rel=1e-4)
    assert found.loops.pin_stroke == pytest.approx(drive.stage_stroke - 2.0 * force / drive.spring_stiffness, rel=1e-3)
    assert abs(found.loops.friction_offset) < 1e-3 * force


@pytest.mark.parametrize("faster", [1.0, 10.0])
def test_a_pin_with_a_strong_damper_that_slides_at_a_turn_stops_there(record, faster):
    """It went on backwards for half of a leg, with friction along its way: 5 % is more than teeth differ."""
    drive = stroke_of(record, 2.0, 0.01, damping_ratio=3.0, profile="sawtooth", stage_cycles=6)
    drive = replace(drive, stage_velocity=faster * drive.stage_velocity)
    legs = measure_strokes(record, plateau_of(record), drive).legs
    np.testing.assert_allclose(legs.middle_force, friction_of(record), rtol=5e-2)


def test_until_the_pin_slides_back_the_spring_force_falls_with_both_stiffnesses_in_series(record):
    drive = stroke_of(record, 1.5, 0.3, damping_ratio=1.0)
    motion = measure_strokes(record, plateau_of(record), drive).motion
    k, surface = drive.spring_stiffness, record.initial_stiffness
    last = slice(-1 - 2 * drive.samples_to_middle, None)
    stage, force = motion.stage[last], motion.spring_force[last]
    ramp = 4.0 * friction_of(record) * (1.0 / k + 1.0 / surface) / 2.0
    gone = abs(stage - stage[0]) / ramp
    first, second = np.searchsorted(gone, (0.2, 0.8))
    slope = (force[second] - force[first]) / (stage[second] - stage[first])
    assert slope == pytest.approx(k * surface / (k + surface), rel=1e-9)


def integrated(record, drive, steps):
    """Work against friction in the last cycle, and the pin's place at its end: velocity Verlet, friction by its increments."""
    force, surface = friction_of(record), record.initial_stiffness
    k, reach = drive.spring_stiffness, 0.5 * drive.stage_stroke
    c = 2.0 * drive.damping_ratio * math.sqrt(k)
    lasts = [0.5, *[1.0] * 2 * drive.stage_cycles]
    x = v = friction = place = 0.0
    works = []
    for leg, share in enumerate(lasts):
        speed = drive.stage_velocity * (-1.0) ** leg
        dt, work = share * drive.stroke_duration / steps, 0.0
        for step in range(steps):
            stage = place + speed * step * dt
            a = k * (stage - x) + c * (speed - v) - friction
            dx = dt * v + 0.5 * dt * dt * a
            after = min(max(friction + surface * dx, -force), force)
            work += 0.5 * (friction + after) * dx
            end = k * (stage + speed * dt - x - dx) + c * (speed - v - dt * a) - after
            x, v, friction = x + dx, v + 0.5 * dt * (a + end), after
        place += speed * share * drive.stroke_duration
        works.append(work)
    assert place == pytest.approx(reach)
    return works[-1] + works[-2], x


def test_a_fast_stage_moves_the_pin_as_an_integrator_of_its_own_does(record):
    """A tenth of the natural frequency: inertia takes a part of each leg. Second order in the step, of 4e-4 of a leg."""
    spring = 0.02
    force = friction_of(record)
    velocity = 0.5 * force / math.sqrt(spring)
    drive = stroke_of(record, 1.5, spring, damping_ratio=0.1, stage_velocity=velocity)
    found = measure_strokes(record, plateau_of(record), drive)
    work, place = integrated(record, drive, 2500)
    assert found.legs.friction_work[-2:].sum() == pytest.approx(work, rel=5e-3)
    assert found.motion.position[-1] == pytest.approx(place, abs=2e-3 * drive.stage_stroke)


@pytest.mark.parametrize("motion", ["triangle", "sine"])
def test_without_a_damper_the_work_of_the_stage_is_that_against_friction_and_what_is_stored(record, motion):
    drive = stroke_of(record, 2.0, 0.3, profile="sawtooth", stage_velocity=1e-4, stage_motion=motion)
    legs = measure_strokes(record, plateau_of(record), drive).legs
    missing = legs.stage_work - legs.friction_work - legs.stored
    assert abs(missing).max() < 1e-10 * legs.stage_work.max()


def test_a_damper_loses_what_its_force_times_its_rate_adds_up_to(record):
    drive = stroke_of(record, 2.0, 0.3, damping_ratio=0.5, stage_velocity=1e-4, samples=40_000)
    found = measure_strokes(record, plateau_of(record), drive)
    c = 2.0 * drive.damping_ratio * math.sqrt(drive.spring_stiffness)
    last = slice(-1 - 8 * drive.samples_to_middle, None)
    motion = found.motion
    sign = np.sign(np.gradient(motion.stage[last]))
    power = c * (sign * drive.stage_velocity - motion.velocity[last]) ** 2
    lost = np.trapezoid(power, motion.time[last]) / 2.0
    # The trapezoidal rule, at jumps of the stage's velocity.
    assert found.loops.damper_energy == pytest.approx(lost, rel=1e-2)


def test_below_sliding_a_record_loses_nothing_and_says_so(record):
    drive = stroke_of(record, 0.4, 0.3, profile="sawtooth", damping_ratio=1.0)
    found = measure_strokes(record, plateau_of(record), drive)
    assert found.outcome.ok
    assert found.outcome.cause == "elastic_record"
    assert abs(found.loops.contact_energy) < 1e-9 * friction_of(record) * drive.stage_stroke
    assert found.loops.leg_regime == "partial_slip"
    assert math.isnan(found.loops.midstroke_friction)


def test_a_pin_too_heavy_for_its_stroke_has_a_loop_of_inertia_not_of_an_elastic_record(record):
    """A leg has passed before the pin has set out: its loop has an area, and no remark denies it."""
    drive = stroke_of(record, 4e-4, 0.3, damping_ratio=1.0, stage_velocity=1e-3)
    found = measure_strokes(record, plateau_of(record), drive)
    assert found.outcome.ok
    assert found.loops.turn_delay > 0.1
    assert found.loops.loop_energy > 0.0
    assert found.outcome.cause == "late_turn"


def test_a_stroke_too_short_to_slide_at_its_middle_has_no_friction_there(record):
    drive = stroke_of(record, 0.8, 0.3, damping_ratio=1.0)
    found = measure_strokes(record, plateau_of(record), drive)
    assert found.loops.leg_regime == "slides"
    assert math.isnan(found.loops.midstroke_friction)
    assert found.outcome.cause == "short_stroke"


def test_a_leg_meets_the_repeated_part_from_where_the_last_one_left_it():
    """What F̃ gives over a whole period is the same from any phase, and at each place that of the limit itself."""
    limit = FrictionLimit(np.array([0.0, 0.1, 0.3, 0.7]), np.array([1.0, 2.0, 1.5]), np.array([0.0, 1.0, 0.5]), 1)
    for phase in (0.0, 0.15, 0.21, 0.55):
        teeth = leg_teeth(limit, phase, 0.25, 3.0)
        assert teeth.force[0] == 3.0
        assert teeth.edges[-1] - teeth.edges[teeth.periodic_from] == pytest.approx(limit.period)
        middles = 0.5 * (teeth.edges[1:-1] + teeth.edges[2:])
        met = teeth.force[1:] + teeth.slope[1:] * (middles - teeth.edges[1:-1])
        assert met == pytest.approx(limit.limit(limit.edges[1] + phase + middles - 0.25))


def test_a_stick_slip_stage_over_its_contact_and_over_its_record_lose_about_the_same(record):
    """Both pull over the same friction; the contact remembers its way, so single loops differ by some percent."""
    drive = stroke_of(record, 1.5, 0.3, profile="sawtooth", damping_ratio=1.0, stage_velocity=1e-5, stage_cycles=2)
    over_record = measure_strokes(record, plateau_of(record), drive)
    memory = replace(drive, memory=True)
    pull = legs_pull_of_contact(CASE, surface_compliance(CASE.slab), memory)
    over_contact = measure_strokes(record, plateau_of(record), memory, pull)
    assert over_contact.outcome.ok
    assert over_contact.loops.contact_energy == pytest.approx(over_record.loops.contact_energy, rel=0.15)
    legs = over_contact.legs
    damper = legs.stage_work - legs.friction_work - legs.stored
    assert damper.min() > 0.0


@pytest.mark.parametrize(("share", "motion"), [(0.4, "triangle"), (0.8, "triangle"), (0.8, "sine")])
def test_below_sliding_a_contact_loses_what_partial_slip_does(share, motion):
    """Mindlin's loss, of nearly Coulomb friction on a half-plane: 257 nodes know it within 2 %, these within 5 %."""
    case = Case.of(
        {
            **{"scheme": "half_plane", "radius": 200.0, "n_x": 65, "residual_shear": 0.98, "coupling": False},
            **{"normal_load": 1e-3, "max_presliding": 4.0, "max_events": 100_000},
        }
    )
    compliance = surface_compliance(case.slab)
    record = slide(case, compliance)
    stiffness, sliding = record.initial_stiffness, case.intrinsic_friction * case.normal_load
    form = MindlinLoops(stiffness, case.slab.poisson, sliding)
    spring = 0.5 * stiffness
    force = share * sliding
    reach = force / spring + float(form.amplitude(share))
    velocity = 1e-4 * reach * math.sqrt(spring)
    drive = Drive(
        spring_stiffness=spring,
        damping_ratio=1.0,
        stage_velocity=velocity,
        stage_stroke=2.0 * reach,
        stage_motion=motion,
        stage_cycles=2,
        samples=400,
        memory=True,
    )
    found = measure_strokes(record, plateau_of(record), drive, legs_pull_of_contact(case, compliance, drive))
    assert found.outcome.ok
    assert found.loops.contact_energy == pytest.approx(float(form.loss(form.amplitude(share))), rel=0.05)
    assert found.loops.leg_regime == "partial_slip"


def test_what_a_stroke_excludes_is_refused_by_name():
    scales = Scales()
    stroke = {"stage_stroke": 1e-4}
    for key, more in {
        "duration": {"duration": 1.0},
        "stage_travel": {"stage_travel": 1e-4},
        "max_slips": {"max_slips": 3},
        "integrator": {"integrator": "rk4", "time_step": 1e-7},
        "stage_velocity": {"stage_velocity": 0.0},
        "surface_compliance": {"surface_compliance": False},
        "reverse_motion": {"reverse_motion": False},
        "stage_frequency": {"stage_frequency": 1.0, "stage_velocity": 1e-3},
        "stage_cycles": {"stage_cycles": 1},
    }.items():
        with pytest.raises(InvalidInput) as refused:
            Drive.from_si(scales, **stroke, **more)
        assert refused.value.key == key
    for key, value in {"stage_cycles": 8, "stage_motion": "sine", "stage_frequency": 1.0}.items():
        with pytest.raises(InvalidInput) as refused:
            Drive.from_si(scales, **{key: value})
        assert refused.value.key == key


def test_a_frequency_gives_the_velocity():
    for motion, longer in {"triangle": 1.0, "sine": math.pi / 2.0}.items():
        drive = Drive.from_si(Scales(), 0.5, stage_stroke=1e-4, stage_frequency=5.0, stage_motion=motion)
        same = Drive.from_si(Scales(), 0.5, stage_stroke=1e-4, stage_velocity=longer * 1e-3, stage_motion=motion)
        assert drive.stage_velocity == pytest.approx(same.stage_velocity)
        assert 2.0 * drive.stroke_duration * Scales().time(0.5) == pytest.approx(0.2)
