"""Hard slips: friction from none to infinite, every residual, ties of mirror nodes, floors, chatter, long cascades, reversal."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, InitialContact, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import SurfaceCompliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import SCHEMES, Slab, Support
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.hard_cases.following import Followed, compliance_of, follow
from tests.mirror import mirrored
from tests.physics import ROWS, coupled_half_plane, energy, half_plane, smallest_step

FRICTIONS = (0.0, 1e-8, 0.05, 1.0, 10.0, 1e3, 1e6, math.inf)
RESIDUALS = (0.0, 0.5, 0.999, 1.0)
NAMED = {
    Ending.COMPLETED,
    Ending.STEEP_PIN,
    Ending.SLIP_UNBOUNDED,
    Ending.CASCADE_LIMIT,
    Ending.NO_EVENT,
    Ending.CONTACT_NOT_CONVERGED,
}
N = 33
SIDEWAYS = tuple(name for name in ROWS if SCHEMES[name].continuum)
"""Schemes whose surface is moved sideways by pressure, so that nodes slip as the pin comes down."""
RECIPROCAL: tuple[Callable[[Slab], SurfaceCompliance], ...] = (half_plane, coupled_half_plane)
FLOORS = (1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)


def _case(friction: float, residual_shear: float, slab: Slab, limit: int = 200_000) -> Case:
    rule = SlipRule(residual_shear=residual_shear, cascade_limit=limit)
    return Case(slab=slab, intrinsic_friction=friction, slip_rule=rule, max_events=1, max_displacement=0.02)


def _pairs() -> list[tuple[float, float]]:
    return [(mu, r) for mu in FRICTIONS for r in RESIDUALS if not (math.isinf(mu) and r == 1.0)]


def _tried(
    friction: float, residual_shear: float, scheme: str, limit: int = 200_000, initial_contact: InitialContact = "stick"
) -> Followed:
    slab = Slab(N, scheme=scheme)
    case = replace(_case(friction, residual_shear, slab, limit), initial_contact=initial_contact)
    return follow(case, compliance_of(slab), 8, 60)


@pytest.mark.everyday
@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize(("friction", "residual_shear"), _pairs())
def test_every_friction_and_residual_obeys_the_laws_or_says_why_not(
    friction: float, residual_shear: float, scheme: str
) -> None:
    seen = _tried(friction, residual_shear, scheme)
    assert not seen.broken
    assert set(seen.endings) <= NAMED
    # Coulomb friction has one answer as long as μ_i is of the order of one: there nothing may fail.
    if residual_shear == 1.0 and Ending.CONTACT_NOT_CONVERGED in seen.endings:
        # All at once there may be no answer; with growing load there is, as the user is told.
        assert "gradual" in " ".join(seen.messages)
        seen = _tried(friction, residual_shear, scheme, initial_contact="gradual")
        assert not seen.broken
        assert set(seen.endings) <= ({Ending.COMPLETED} if 1e-3 <= friction <= 1.0 else NAMED)
    elif friction <= 1.0:
        # Less than the pin's slopes, 1e-3 here, it cannot hold a node on a flank.
        assert set(seen.endings) <= {Ending.COMPLETED, *([Ending.STEEP_PIN] if friction < 1e-3 else [])}
    elif set(seen.endings) != {Ending.COMPLETED}:
        assert "intrinsic_friction" in " ".join(seen.messages) or "slip.residual_shear" in " ".join(seen.messages)


@pytest.mark.parametrize("operator", RECIPROCAL)
@pytest.mark.parametrize("residual_shear", [0.0, 0.5, 0.999])
@pytest.mark.parametrize("friction", [0.05, 1.0, 10.0])
def test_energy_is_balanced_and_never_created(
    friction: float, residual_shear: float, operator: Callable[[Slab], SurfaceCompliance]
) -> None:
    slab = Slab(N, poisson=0.2)
    compliance = operator(slab)
    case = replace(_case(friction, residual_shear, slab, 10**6), max_events=100)
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    found = energy(case, start, record, end)
    assert found.missing < 1e-9  # of 1e5 slips of a thousandth each, rounding of every one
    assert record.dissipated.min(initial=0.0) >= -1e-12 * found.largest


@pytest.mark.parametrize(
    ("support", "scheme"),
    [*(("bonded", scheme) for scheme in ROWS), ("frictionless", "biquadratic"), ("frictionless", "galerkin")],
)
def test_sliding_left_mirrors_sliding_right(support: Support, scheme: str) -> None:
    """From a symmetric contact: the same events at mirrored nodes, in ties the node ahead first, forces of other sign."""
    slab = Slab(N, support=support, scheme=scheme)
    case = Case(slab=slab, initial_contact="frictionless", max_events=40)
    compliance = compliance_of(slab)
    start = initial_contact(case, compliance)
    right, left = slide(case, compliance, start), slide(case, compliance, mirrored(start))
    np.testing.assert_array_equal(left.node, right.node)
    np.testing.assert_array_equal(left.slips, right.slips)
    # The contact is symmetric to rounding times its condition.
    np.testing.assert_allclose(left.force_after, right.force_after, atol=1e-9 * case.normal_load)


def test_a_mirror_image_of_a_mirror_image_is_the_contact_itself() -> None:
    case = Case(slab=Slab(N), max_events=30)
    _, state = slide_to_state(case, compliance_of(case.slab))
    again = mirrored(mirrored(state))
    for name in ("contact", "pressure", "shear", "slip", "gap", "u", "w", "nodal_force"):
        np.testing.assert_array_equal(getattr(again, name), getattr(state, name))
    assert again.displacement == state.displacement


def _turned_back(scheme: str, residual_shear: float) -> Followed:
    """Right until friction is full, left until it is full again, right once more; laws after every stretch and in between."""
    slab = Slab(N, scheme=scheme)
    compliance = compliance_of(slab)
    case = Case(slab=slab, slip_rule=SlipRule(residual_shear=residual_shear), max_events=25, max_displacement=1.0)
    seen, state = Followed(), initial_contact(case, compliance)
    for _ in range(3):
        for _ in range(20):
            seen.record, state = slide_to_state(case, compliance, state)
            if not seen.check(state, case, compliance):
                return seen
        state = mirrored(state)
        seen.check(state, case, compliance)
    seen.endings[Ending.COMPLETED] += 1
    seen.end = state
    return seen


@pytest.mark.parametrize(
    ("residual_shear", "scheme"), [*((0.0, scheme) for scheme in ROWS), (0.5, "galerkin"), (0.5, "half_plane")]
)
def test_a_pin_that_turns_back_obeys_the_laws(residual_shear: float, scheme: str) -> None:
    seen = _turned_back(scheme, residual_shear)
    assert not seen.broken
    assert set(seen.endings) == {Ending.COMPLETED}
    # After turning, friction opposes the new motion: in the mirror it is positive again.
    assert seen.record is not None
    assert seen.record.final_force > 0.2 * seen.record.normal_load


@pytest.mark.parametrize("operator", RECIPROCAL)
def test_turning_back_dissipates_and_balances_its_energy(operator: Callable[[Slab], SurfaceCompliance]) -> None:
    slab = Slab(N, poisson=0.2)
    compliance = operator(slab)
    case = Case(slab=slab, max_events=200)
    _, full = slide_to_state(case, compliance)
    start = mirrored(full)
    record, end = slide_to_state(case, compliance, start)
    found = energy(case, start, record, end)
    # On the way through zero the pin first gives back what it had stored.
    assert record.initial_force < 0.0 < record.final_force
    assert found.missing < 1e-10
    assert record.dissipated.min() >= -1e-12 * found.largest


def _waves(height: float) -> Heterogeneity:
    heights = height * np.random.default_rng(7).standard_normal(61)
    return Heterogeneity(roughness=tuple(zip(np.linspace(-0.6, 0.6, 61).tolist(), heights.tolist(), strict=True)))


def test_the_event_floor_does_not_matter_in_its_range() -> None:
    """Up to 1e-7 of a spacing the plateau is the same to rounding, at the default 1e-6 to 1e-6, up to 1e-5 to its own
    uncertainty, a few thousandths."""
    case = Case(slab=Slab(65), max_events=None, max_displacement=6e-3)
    rules = {
        floor: SlipRule(event_floor=floor) for floor in FLOORS if floor <= 1e-5
    }  # beyond, a step may break the law
    plateaus = {
        floor: plateau_of(slide(replace(case, slip_rule=rule), compliance_of(case.slab))).mean
        for floor, rule in rules.items()
    }
    for floor, plateau in plateaus.items():
        tolerance = 1e-11 if floor <= 1e-7 else 1e-6 if floor <= 1e-6 else 5e-3
        assert plateau == pytest.approx(plateaus[1e-12], rel=tolerance), floor


LIGHT = {
    **{
        f"W = {normal_load:g}": {"normal_load": normal_load, "radius": 0.2 / normal_load}
        for normal_load in (1e-3, 1e-7, 1e-9, 1e-12, 1e-20)
    },
    "W = 1e-9, one node": {"normal_load": 1e-9},
    "W = 1e-12, one node": {"normal_load": 1e-12},
    "μ_i = 1e-3": {"intrinsic_friction": 1e-3, "normal_load": 1e-5, "radius": 2e4},
    "μ_i = 1e-5": {"intrinsic_friction": 1e-5, "normal_load": 1e-7, "radius": 2e6},
    "μ_i = 1e-8": {"intrinsic_friction": 1e-8, "normal_load": 1e-11, "radius": 2e10},
    "thin": {"slab": Slab(129, aspect_ratio=1e-3)},
    "constant pressures": {"normal_load": 1e-9, "effects": Effects(pin_translation=False)},
}
"""Cases whose event floor would push nodes beyond their friction limit, or nearly: light loads, little friction, stiff slabs."""


@pytest.mark.parametrize("name", LIGHT)
def test_the_friction_law_holds_before_every_event(name: str) -> None:
    """|F| ≤ μ_i·W just before a node slips too, to 1e-4; the smallest step moves forces by less than that, whatever the load."""
    case = Case(**LIGHT[name])  # type: ignore[arg-type]
    record = slide(case, compliance_of(case.slab))
    assert record.outcome.ok, record.outcome
    assert len(record.kind) == 2000
    assert record.force_before.max() <= case.intrinsic_friction * case.normal_load * (1 + 1e-4)
    assert np.diff(record.displacement, prepend=0.0).min() > 0.0


@pytest.mark.parametrize("normal_load", [1e-3, 1e-7, 1e-12, 1e-20])
def test_with_constant_pressures_the_smallest_step_is_that_of_moving_ones(normal_load: float) -> None:
    """Taken, and not undercut: of 2000 events some follow each other at once."""
    case = Case(
        normal_load=normal_load,
        radius=0.2 / normal_load,
        effects=Effects(pin_translation=False),
        slip_rule=SlipRule(event_floor=1e-5),
    )
    record = slide(case, compliance_of(case.slab))
    assert record.outcome.ok, record.outcome
    steps = np.diff(record.displacement, prepend=0.0)
    # The steps are differences of rounded displacements.
    assert steps.min() == pytest.approx(smallest_step(case, record.initial_stiffness), rel=1e-9, abs=0.0)


def test_a_record_does_not_depend_on_the_load_alone() -> None:
    """With W·R kept, W is a unit: F/W over δ_p/W is the same to what the pin's shift against the nodes changes."""
    plateaus = [
        plateau_of(slide(Case(**LIGHT[f"W = {normal_load:g}"]), compliance_of(Slab()))).mean
        for normal_load in (1e-7, 1e-9, 1e-12)
    ]  # type: ignore[arg-type]
    # Records are chaotic and span 1e-5 spacings of these: they agree as far as 2000 events know their mean.
    np.testing.assert_allclose(plateaus, 0.2655, rtol=2e-3)


def test_a_floor_that_breaks_the_friction_law_is_an_outcome() -> None:
    record = slide(Case(slip_rule=SlipRule(event_floor=1e-2)), compliance_of(Slab()))
    assert record.outcome.ending is Ending.OVERSHOT
    assert "slip.event_floor" in record.outcome.message
    case = Case(slip_rule=SlipRule(event_floor=1e-2), effects=Effects(pin_translation=False))
    assert slide(case, compliance_of(Slab())).outcome.ending is Ending.OVERSHOT


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_chatter_cannot_stop_the_pin(friction: float, floor: float) -> None:
    """Zeno's paradox: events follow each other ever faster, but every one moves the pin by the floor or more,
    by something even where there is no friction."""
    slab = Slab(N)
    case = Case(slab=slab, intrinsic_friction=friction, slip_rule=SlipRule(event_floor=floor), max_events=100)
    record = slide(case, compliance_of(slab))
    if not record.outcome.ok:  # a floor that moves the pin by more than the law allows
        assert record.outcome.ending is Ending.OVERSHOT
        assert floor > 1e-5
        return
    steps = np.diff(record.displacement, prepend=0.0)
    # The steps are differences of rounded displacements.
    assert (
        steps.min()
        >= smallest_step(case, 3.0 * record.stiffness.max()) * (1 - 1e-9) - 2e-16 * record.final_displacement
    )
    assert steps.min() > 0.0


@pytest.mark.parametrize("scheme", ["biquadratic", "half_plane"])
def test_a_cascade_of_a_million_slips_obeys_the_laws(scheme: str) -> None:
    """Without friction every shear is slipped away one node at a time: more than a million slips at n_x = 129."""
    slab = Slab(129, scheme=scheme)
    case = Case(slab=slab, intrinsic_friction=0.0, max_events=2)
    seen = follow(case, compliance_of(slab), 1, 2)
    assert not seen.broken
    assert set(seen.endings) == {Ending.COMPLETED}
    assert initial_contact(case, compliance_of(slab)).slips > (1_000_000 if scheme == "biquadratic" else 100_000)


def test_residual_shear_is_what_is_left() -> None:
    """|shear| of the node that slipped last is residual_shear·μ_i·pressure, in every residual."""
    slab = Slab(N)
    compliance = compliance_of(slab)
    for residual_shear in (0.0, 0.5, 0.999):
        case = replace(_case(0.5, residual_shear, slab), max_events=1, max_displacement=None)
        state = initial_contact(case, compliance)
        for _ in range(30):
            record, state = slide_to_state(case, compliance, state)
            if record.slips[0] == 1 and record.kind[0] == 0 and record.touches[0] == record.releases[0] == 0:
                node = record.node[0]
                left = abs(state.nodal_force[0, node]) - residual_shear * 0.5 * -state.nodal_force[1, node]
                assert abs(left) < 1e-12 * case.normal_load


STEEP = {
    # How steep a pin is where it touches, against μ_i, decides; below half of μ_i all is well.
    "paper": ({}, True),
    "small pin, small load": (
        {"radius": 0.5, "normal_load": 1e-4, "intrinsic_friction": 0.5, "max_displacement": 0.1},
        True,
    ),
    "small pin, slope above half of μ_i": ({"radius": 0.2, "normal_load": 3e-2, "intrinsic_friction": 0.1}, False),
    "steep against a small μ_i": ({"intrinsic_friction": 1e-3}, False),
    "above 45°": ({"radius": 0.02, "normal_load": 0.1}, False),
    "rough, slopes of some hundredths": ({"heterogeneity": _waves(1e-4)}, True),
    "rough, slopes of some tens": ({"heterogeneity": _waves(0.3), "radius": 1.0}, False),
    "rough, slopes near μ_i": ({"heterogeneity": _waves(3e-3), "radius": 1.0, "intrinsic_friction": 0.1}, False),
}


def _steep(scheme: str, residual_shear: float, changes: dict[str, Any]) -> FrictionRecord:
    slab = Slab(N, scheme=scheme)
    rule = SlipRule(residual_shear=residual_shear, cascade_limit=20_000)
    case = Case(**{"slab": slab, "slip_rule": rule, "max_events": 60, "max_displacement": 0.3, **changes})
    return slide(case, compliance_of(slab))


def _created(record: FrictionRecord) -> float:
    """The largest energy that an event created, as a share of all that was dissipated."""
    return max(-float(record.dissipated.min(initial=0.0)), 0.0) / max(float(np.abs(record.dissipated).sum()), 1e-300)


@pytest.mark.parametrize("scheme", ROWS)
@pytest.mark.parametrize("residual_shear", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("name", STEEP)
def test_no_completed_record_creates_energy(name: str, residual_shear: float, scheme: str) -> None:
    """Rounding leaves 1e-30 of it at the default event floor; steep pins left 1e-4 to 1e-1 (1e-10: between them)."""
    changes, flat = STEEP[name]
    record = _steep(scheme, residual_shear, changes)
    assert _created(record) < 1e-10 or record.outcome.ending is Ending.STEEP_PIN
    assert record.outcome.ending in (Ending.COMPLETED, Ending.STEEP_PIN)
    assert record.outcome.ok or not flat
    if not record.outcome.ok:
        assert "radius" in record.outcome.message


@pytest.mark.parametrize("name", [name for name, (_, flat) in STEEP.items() if not flat])
def test_every_kind_of_steep_pin_is_named_somewhere(name: str) -> None:
    endings = {
        _steep(scheme, residual_shear, STEEP[name][0]).outcome.ending
        for scheme in ROWS
        for residual_shear in (0.0, 0.5)
    }
    assert Ending.STEEP_PIN in endings


@pytest.mark.parametrize("order", ["worst_first", "simultaneous"])
def test_slips_down_a_flank_without_end_are_a_steep_pin_and_not_a_cascade(order: str) -> None:
    """Pressed down gradually the contact slips on and on, and gains energy from it: known long before `cascade_limit`."""
    slab, rule = Slab(33, scheme="half_plane"), SlipRule(slip_order=order)  # type: ignore[arg-type]
    case = Case(1.44e-6, 6.83e3, 9.32e-5, slab, slip_rule=rule, initial_contact="gradual")
    state = initial_contact(case, compliance_of(slab))
    assert state.outcome.ending is Ending.STEEP_PIN
    assert state.slips < rule.cascade_limit / 10


def test_sliding_at_the_limit_up_a_flank_steeper_than_friction_is_named() -> None:
    """Residual 1 has a solver of its own: at μ_i = 0.05 and a slope of 0.7 a fiftieth of the work came from nowhere."""
    for friction, steep in ((0.05, True), (1.0, False)):
        slab = Slab(17)
        case = Case(
            slab=slab, radius=0.1, normal_load=0.1, intrinsic_friction=friction, slip_rule=SlipRule(residual_shear=1.0)
        )
        record = slide(replace(case, max_events=40, max_displacement=0.1), compliance_of(slab))
        assert record.outcome.ending is (Ending.STEEP_PIN if steep else Ending.COMPLETED)


def test_a_pin_steeper_than_friction_slides_at_the_limit_where_no_energy_comes_from_nowhere() -> None:
    """Slopes of 1.5e-3, fifteen times μ_i, under the default load."""
    case = Case(1e-4, slab=Slab(N), slip_rule=SlipRule(residual_shear=1.0), max_events=40, max_displacement=0.02)
    record = slide(case, compliance_of(case.slab))
    assert record.outcome.ok, record.outcome
    assert record.final_force == pytest.approx(1e-4 * case.normal_load, rel=1e-3)


def test_slips_at_once_that_create_energy_are_named() -> None:
    """Without coupling all nodes of a punch slip at once by what each would alone, and overshoot: a third of the events gain."""
    slab = Slab(33, poisson=0.49)
    case = Case(
        normal_load=6.2e-6,
        pin="flat_punch",
        slab=slab,
        intrinsic_friction=0.0726,
        effects=Effects(coupling=False),
        max_events=2000,
    )
    record = slide(replace(case, slip_rule=SlipRule(slip_order="simultaneous")), compliance_of(slab))
    assert record.outcome.ending is Ending.ENERGY_CREATED
    assert "worst_first" in record.outcome.message
    assert slide(case, compliance_of(slab)).outcome.ok


def test_a_slab_that_pushes_where_it_is_pushed_has_no_friction() -> None:
    """The stencil's operator of a thin slab is indefinite: K = -19 gave a plateau of -0.04, completed."""
    slab = Slab(65, aspect_ratio=0.0108, poisson=0.0, support="right_side", scheme="biquadratic")
    case = Case(normal_load=5.8e-4, radius=3600.0, intrinsic_friction=0.64, slab=slab, effects=Effects(coupling=False))
    record = slide(replace(case, max_events=500), compliance_of(slab))
    assert record.initial_stiffness < 0.0
    assert record.outcome.ending is Ending.SINGULAR_OPERATOR
    assert "scheme galerkin" in record.outcome.message
