"""Contact without shear on a half-plane, by convolutions: the contact that its matrix has, Hertz's, one that obeys all laws."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity
from nanoslip.solver.contact import convolved, initial
from nanoslip.solver.contact import normal as exchange
from nanoslip.solver.contact.closed_forms import flat_punch_pressure, hertz
from nanoslip.solver.contact.initial import compliance_for_contact, initial_contact
from nanoslip.solver.contact.pin import pin_of, surface_from_pin
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import NormalCompliance, normal_compliance, surface_compliance
from nanoslip.solver.elasticity.schemes.endless import convolution_of
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.parameter import Roughness
from nanoslip.solver.slab import Slab
from tests.physics import assert_contact_laws

UNCOUPLED, FRICTIONLESS = Effects(coupling=False), Effects(friction=False)


def rough(height: float, points: int = 201) -> Roughness:
    heights = height * np.random.default_rng(3).standard_normal(points)
    return tuple(zip(np.linspace(-0.6, 0.6, points).tolist(), heights.tolist(), strict=True))


def case_of(n_x: int = 129, poisson: float = 1 / 3, effects: Effects = UNCOUPLED, **given: object) -> Case:
    return replace(Case(slab=Slab(n_x=n_x, poisson=poisson, scheme="half_plane"), effects=effects), **given)  # type: ignore[arg-type]


PINS: dict[str, dict[str, object]] = {
    "parabola": {},
    "between nodes": {"start": 0.3},
    "one node": {"normal_load": 1e-12},
    "few nodes, 45° steep": {"radius": 0.07, "normal_load": 5e-2},
    "all nodes": {"radius": 1e5},
    "punch": {"pin": "flat_punch"},
    "punch between nodes": {"pin": "flat_punch", "half_width": 0.1, "start": 0.7},
    "punch over all": {"pin": "flat_punch", "half_width": 0.5},
    "rough": {"heterogeneity": Heterogeneity(roughness=rough(1e-5))},
    "spots": {"heterogeneity": Heterogeneity(roughness=rough(1e-4)), "normal_load": 1e-2},
}


@pytest.mark.parametrize("pin", PINS)
@pytest.mark.parametrize("effects", [UNCOUPLED, FRICTIONLESS, Effects(friction=False, coupling=False)], ids=str)
@pytest.mark.parametrize(("n_x", "poisson"), [(129, 1 / 3), (101, 0.0), (257, 0.49), (5, -0.5)])
def test_the_contact_is_that_of_the_matrix(pin: str, effects: Effects, n_x: int, poisson: float) -> None:
    """Both solve for the forces of the same nodes: to rounding, 1e-12 of the load; and its laws hold."""
    case = case_of(n_x, poisson, effects, **PINS[pin])
    dense = surface_compliance(case.slab)
    expected, found = initial_contact(case, dense), initial_contact(case, normal_compliance(case.slab))
    assert found.outcome.ending == expected.outcome.ending
    np.testing.assert_array_equal(found.contact, expected.contact)
    for name in ("nodal_force", "u", "w", "approach"):
        exact = getattr(expected, name)
        np.testing.assert_allclose(getattr(found, name), exact, rtol=0.0, atol=1e-12 * case.normal_load, err_msg=name)
    # A node beside a punch is never under it, even where it has moved there.
    if case.pin == "parabola" and not case.effects.friction and case.effects.coupling:
        assert_contact_laws(found, replace(case, intrinsic_friction=0.0), dense)


@pytest.mark.parametrize("pin", ["parabola", "punch", "rough", "spots"])
def test_the_contact_of_a_thousand_nodes_is_that_of_the_matrix(pin: str) -> None:
    case = case_of(1025, effects=FRICTIONLESS, **PINS[pin])
    expected, found = (initial_contact(case, make(case.slab)) for make in (surface_compliance, normal_compliance))
    np.testing.assert_array_equal(found.contact, expected.contact)
    np.testing.assert_allclose(found.nodal_force, expected.nodal_force, rtol=0.0, atol=1e-12 * case.normal_load)


@pytest.mark.parametrize("pin", ["parabola", "punch", "rough"])
def test_equilibrium_and_complementarity_on_a_hundred_thousand_nodes(pin: str) -> None:
    """Shares of the load, and of what it displaces. A matrix would take 320 GB."""
    given = PINS[pin]
    if pin == "punch":  # nodes that move sideways by half a spacing, 5e-6, have come in under its edge
        given = {**given, "normal_load": 1e-5}
    case = case_of(100_001, effects=FRICTIONLESS, **given)
    compliance = compliance_for_contact(case)
    assert isinstance(compliance, NormalCompliance)
    state = initial_contact(case, compliance)
    assert state.outcome.ok
    load, convolution = case.normal_load, compliance.convolution
    force = -state.nodal_force[1]
    assert force.sum() == pytest.approx(load, rel=1e-12)
    assert force.min() >= -1e-12 * load
    assert not force[~state.contact].any()
    np.testing.assert_allclose(state.w, convolution.w(-force), rtol=0.0, atol=1e-12 * load)
    np.testing.assert_allclose(state.u, convolution.u(-force), rtol=0.0, atol=1e-12 * load)
    xi = surface_from_pin(case) + state.u
    on_the_pin = (state.w + state.approach - pin_of(case).height(xi))[state.contact]
    np.testing.assert_allclose(on_the_pin, 0.0, atol=1e-12 * load)
    # A node beside a punch is never under it, even where it has moved there.
    beneath = np.abs(surface_from_pin(case)) <= pin_of(case).half_width
    assert state.gap[beneath].min() >= -1e-12 * load


def from_hertz(n_x: int, start: float) -> tuple[float, float]:
    """How far approach, in W/G, and half-width, by the second moment of pressure, are from Hertz's.

    The surface under his pressure, 0 under the pin's lowest point, has fallen by W(1-ν)/π (ln(2D/a) + 1/2) - W/2π there: the
    integral of his pressure times the half-plane's logarithm, and the datum of its depth D, here 1.
    """
    poisson = 0.3
    case = case_of(n_x, poisson, start=start)
    state = initial_contact(case, compliance_for_contact(case))
    theory = hertz(case.normal_load, case.radius, poisson)
    approach = (1 - poisson) / math.pi * (math.log(2 / theory.half_width) + 0.5) - 1 / (2 * math.pi)
    moment = float((-state.nodal_force[1] * surface_from_pin(case) ** 2).sum()) / case.normal_load
    return abs(state.approach / case.normal_load - approach), abs(2 * math.sqrt(moment) / theory.half_width - 1)


def test_hertz_comes_out_to_second_order() -> None:
    """The worst of three starts at each spacing, as the contact's ends may happen to be at a node."""
    sizes = (129, 1025, 8193, 65_537)
    errors = np.array([np.max([from_hertz(n_x, start) for start in (0.0, 0.3, 0.5)], axis=0) for n_x in sizes])
    orders = np.log(errors[0] / errors[-1]) / math.log((sizes[-1] - 1) / (sizes[0] - 1))
    assert orders.min() > 1.9, (orders, errors)
    assert errors[-1].max() < 1e-8


def test_a_wide_punch_on_a_fine_surface_is_that_of_the_closed_form() -> None:
    """Away from its edges, where pressure is infinite: to the width that the edge nodes add, one spacing in 16 384 of a half."""
    case = case_of(16_385, pin="flat_punch", half_width=0.25)
    state = initial_contact(case, compliance_for_contact(case))
    inside = np.abs(state.x) < 0.2
    theory = flat_punch_pressure(state.x[inside], 0.25, case.normal_load)
    np.testing.assert_allclose(state.pressure[inside], theory, rtol=5e-4)


def test_the_contact_has_the_least_energy_of_all_that_push_with_the_load() -> None:
    """Moving some of the load to other nodes, in contact or not, costs energy."""
    case = case_of(257, heterogeneity=Heterogeneity(roughness=rough(3e-5)))
    state = initial_contact(case, compliance_for_contact(case))
    convolution, heights = convolution_of(case.slab), pin_of(case).face(surface_from_pin(case))

    def energy(force: np.ndarray) -> float:
        return float(force @ convolution.w(force) / 2 + heights @ force)

    force, generator = -state.nodal_force[1], np.random.default_rng(5)
    for _ in range(20):
        other = np.where(generator.random(257) < 0.1, generator.random(257), 0.0)
        mixed = 0.99 * force + 0.01 * case.normal_load * other / other.sum()
        assert energy(mixed) > energy(force)


def test_exchanging_one_node_at_a_time_finds_the_same_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is left when exchanging all wrong nodes goes round in circles."""
    case = case_of(65, heterogeneity=Heterogeneity(roughness=rough(3e-5)))
    expected = initial_contact(case, compliance_for_contact(case))
    monkeypatch.setattr(exchange, "PATIENCE", 0)
    found = initial_contact(case, compliance_for_contact(case))
    np.testing.assert_array_equal(found.contact, expected.contact)
    np.testing.assert_allclose(found.nodal_force, expected.nodal_force, atol=1e-12 * case.normal_load)


def test_a_contact_that_is_not_found_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convolved, "MOST_ROUNDS", 1)
    case = case_of(heterogeneity=Heterogeneity(roughness=rough(1e-5)))
    assert initial_contact(case, compliance_for_contact(case)).outcome.ending is Ending.CONTACT_NOT_CONVERGED


@pytest.mark.parametrize(
    ("n_x", "poisson", "normal_load", "slope"),
    [(65, -0.5, 1e-7, 0.7), (33, -0.99, 3e-10, 0.9), (65, 0.0, 3e-9, 0.9), (5, 0.0, 1e-7, 0.5)],
)
def test_nodes_that_move_by_less_than_rounding_are_at_rest(
    n_x: int, poisson: float, normal_load: float, slope: float
) -> None:
    """Two nodes on the flanks of a wedge, whose heights are rounded by far more than 1e-13 of what a small load moves."""
    wedge = Heterogeneity(roughness=((-0.6, 0.6 * slope), (0.0, 0.0), (0.6, 0.6 * slope)))
    case = case_of(n_x, poisson, FRICTIONLESS, start=0.5, normal_load=normal_load, heterogeneity=wedge)
    assert initial_contact(case, compliance_for_contact(case)).outcome.ok
    assert initial_contact(case, surface_compliance(case.slab)).outcome.ok


def test_nodes_that_pull_on_the_way_to_a_contact_stay_among_numbers() -> None:
    """Each round would move them further along flanks that are too steep."""
    case = case_of(5, 0.0, FRICTIONLESS, radius=9.7e-12, normal_load=0.5, start=0.3)
    with np.errstate(all="raise", under="ignore"):
        assert initial_contact(case, compliance_for_contact(case)).outcome.ending is Ending.STEEP_PIN


def test_flanks_that_are_too_steep_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pressure moves nodes along them ever further; the steepness is why, not the contact."""
    monkeypatch.setattr(convolved, "MOST_ROUNDS", 30)
    case = case_of(257, -0.5, FRICTIONLESS, normal_load=1e-2, heterogeneity=Heterogeneity(roughness=rough(1e-1, 401)))
    assert initial_contact(case, compliance_for_contact(case)).outcome.ending is Ending.STEEP_PIN


def test_a_punch_whose_node_moves_out_from_under_it_is_named() -> None:
    case = case_of(33, -0.9, FRICTIONLESS, pin="flat_punch", half_width=0.1, normal_load=1.0)
    dense = initial_contact(case, surface_compliance(case.slab))
    assert initial_contact(case, compliance_for_contact(case)).outcome == dense.outcome


def test_only_a_pin_that_drags_nothing_needs_no_matrix() -> None:
    assert case_of(effects=UNCOUPLED).contact_by_convolution
    assert case_of(effects=FRICTIONLESS).contact_by_convolution
    assert not case_of(effects=Effects()).contact_by_convolution
    assert not Case(effects=FRICTIONLESS).contact_by_convolution


def test_no_matrix_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(initial, "surface_compliance", None)
    case = case_of()
    state = initial_contact(case, compliance_for_contact(case))
    assert isinstance(state, ContactState)
    assert state.outcome.ok


def test_a_case_that_drags_has_its_matrix_made_of_the_slab() -> None:
    case = case_of(33, effects=Effects())
    found = initial_contact(case, normal_compliance(case.slab))
    np.testing.assert_array_equal(found.nodal_force, initial_contact(case, surface_compliance(case.slab)).nodal_force)


def test_a_datum_too_near_is_refused_without_a_matrix_too() -> None:
    with pytest.raises(InvalidInput, match="needs a deeper datum"):
        normal_compliance(Slab(n_x=129, aspect_ratio=0.4, scheme="half_plane"))
