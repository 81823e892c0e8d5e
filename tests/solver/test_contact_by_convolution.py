"""Contact without shear on a half-plane, by convolutions: the contact that its matrix has, Hertz's, one that obeys all laws.

The forces of a given set come from preconditioned conjugate gradients: those of a dense solve, at once where it is one piece.
"""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity
from nanoslip.solver.contact import convolved, normal
from nanoslip.solver.contact.closed_forms import flat_punch_pressure, hertz
from nanoslip.solver.contact.convolved import press_by_convolution
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.pin import make_pin, surface_from_pin
from nanoslip.solver.elasticity.compliance import EndlessCompliance, SurfaceCompliance, surface_compliance
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from tests.physics import assert_contact_laws

UNCOUPLED, FRICTIONLESS = Effects(coupling=False), Effects(friction=False)


def rough(height, points=201):
    heights = height * np.random.default_rng(3).standard_normal(points)
    profile = zip(np.linspace(-0.6, 0.6, points).tolist(), heights.tolist(), strict=True)
    return {"heterogeneity": Heterogeneity(roughness=tuple(profile))}


def case_of(n_x=129, poisson=1 / 3, effects=UNCOUPLED, **given):
    return Case(slab=Slab(n_x=n_x, poisson=poisson, scheme="half_plane"), effects=effects, **given)


def convolved_contact(case):
    return initial_contact(case, surface_compliance(case.slab))


PINS = {
    "parabola": {},
    "between nodes": {"start": 0.3},
    "one node": {"normal_load": 1e-12},
    "few nodes, 45° steep": {"radius": 0.07, "normal_load": 5e-2},
    "all nodes": {"radius": 1e5},
    "punch": {"pin": "flat_punch"},
    "punch between nodes": {"pin": "flat_punch", "half_width": 0.1, "start": 0.7},
    "punch over all": {"pin": "flat_punch", "half_width": 0.5},
    "rough": rough(1e-5),
    "spots": {**rough(1e-4), "normal_load": 1e-2},
}


REDUCED = (UNCOUPLED, FRICTIONLESS, Effects(friction=False, coupling=False))
SCENES = [
    *product(PINS, REDUCED, [(129, 1 / 3), (101, 0.0), (257, 0.49), (5, -0.5)]),
    *product(("parabola", "punch", "rough", "spots"), [FRICTIONLESS], [(1025, 1 / 3)]),
]


@pytest.mark.parametrize(("pin", "effects", "slab"), SCENES)
def test_the_contact_is_that_of_the_matrix(pin, effects, slab):
    """Both solve for the forces of the same nodes: to rounding, 1e-12 of the load; and its laws hold."""
    case = case_of(*slab, effects, **PINS[pin])
    endless = surface_compliance(case.slab)
    dense = SurfaceCompliance(endless.matrix, case.slab)
    expected, found = initial_contact(case, dense), initial_contact(case, endless)
    assert found.outcome.ending == expected.outcome.ending
    np.testing.assert_array_equal(found.contact, expected.contact)
    for name in ("nodal_force", "u", "w", "approach"):
        exact = getattr(expected, name)
        np.testing.assert_allclose(getattr(found, name), exact, rtol=0.0, atol=1e-12 * case.normal_load, err_msg=name)
    # A node beside a punch is never under it, even where it has moved there.
    if case.pin == "parabola" and effects is FRICTIONLESS:
        assert_contact_laws(found, replace(case, intrinsic_friction=0.0), dense)


@pytest.mark.parametrize("pin", ["parabola", "punch", "rough"])
def test_equilibrium_and_complementarity_on_thirty_thousand_nodes(pin):
    """Shares of the load, and of what it displaces. A matrix would take 29 GB."""
    # Nodes that move sideways by half a spacing, 1.7e-5, have come in under a punch's edge.
    given = {**PINS[pin], "normal_load": 1e-5} if pin == "punch" else PINS[pin]
    case = case_of(30_001, effects=FRICTIONLESS, **given)
    compliance = surface_compliance(case.slab)
    assert isinstance(compliance, EndlessCompliance)
    state = initial_contact(case, compliance)
    assert state.outcome.ok
    load, force, place = case.normal_load, -state.nodal_force[1], surface_from_pin(case)
    assert force.sum() == pytest.approx(load, rel=1e-12)
    assert force.min() >= -1e-12 * load
    assert not force[~state.contact].any()
    np.testing.assert_allclose(state.w, compliance.convolution.w(-force), rtol=0.0, atol=1e-12 * load)
    np.testing.assert_allclose(state.u, compliance.convolution.u(-force), rtol=0.0, atol=1e-12 * load)
    on_the_pin = (state.w + state.approach - make_pin(case).height(place + state.u))[state.contact]
    np.testing.assert_allclose(on_the_pin, 0.0, atol=1e-12 * load)
    # A node beside a punch is never under it, even where it has moved there.
    assert state.gap[np.abs(place) <= make_pin(case).half_width].min() >= -1e-12 * load


def from_hertz(n_x, start):
    """How far approach, in W/G, and half-width, by the second moment of pressure, are from Hertz's.

    The surface under his pressure, 0 under the pin's lowest point, has fallen by W(1-ν)/π (ln(2D/a) + 1/2) - W/2π there: the
    integral of his pressure times the half-plane's logarithm, and the datum of its depth D, here 1.
    """
    case = case_of(n_x, 0.3, start=start)
    state, theory = convolved_contact(case), hertz(case.normal_load, case.radius, 0.3)
    approach = 0.7 / math.pi * (math.log(2 / theory.half_width) + 0.5) - 1 / (2 * math.pi)
    moment = float((-state.nodal_force[1] * surface_from_pin(case) ** 2).sum()) / case.normal_load
    return abs(state.approach / case.normal_load - approach), abs(2 * math.sqrt(moment) / theory.half_width - 1)


def test_hertz_comes_out_to_second_order():
    """The worst of three starts at each spacing, as the contact's ends may happen to be at a node."""
    sizes = (129, 1025, 8193, 65_537)
    errors = np.array([np.max([from_hertz(n_x, start) for start in (0.0, 0.3, 0.5)], axis=0) for n_x in sizes])
    orders = np.log(errors[0] / errors[-1]) / math.log((sizes[-1] - 1) / (sizes[0] - 1))
    assert orders.min() > 1.9, (orders, errors)
    assert errors[-1].max() < 1e-8


def test_a_wide_punch_on_a_fine_surface_is_that_of_the_closed_form():
    """Away from its edges, where pressure is infinite: to the width that the edge nodes add, one spacing in 16 384 of a half."""
    case = case_of(16_385, pin="flat_punch", half_width=0.25)
    state = convolved_contact(case)
    inside = np.abs(state.x) < 0.2
    theory = flat_punch_pressure(state.x[inside], 0.25, case.normal_load)
    np.testing.assert_allclose(state.pressure[inside], theory, rtol=5e-4)


def energy(convolution, heights, force):
    return float(force @ convolution.w(force) / 2 + heights @ force)


def test_the_contact_has_the_least_energy_of_all_that_push_with_the_load():
    """Moving some of the load to other nodes, in contact or not, costs energy."""
    case = case_of(257, **rough(3e-5))
    body = surface_compliance(case.slab).convolution, make_pin(case).unbounded_height(surface_from_pin(case))
    force, generator = -convolved_contact(case).nodal_force[1], np.random.default_rng(5)
    for _ in range(20):
        other = np.where(generator.random(257) < 0.1, generator.random(257), 0.0)
        assert energy(*body, 0.99 * force + 0.01 * case.normal_load * other / other.sum()) > energy(*body, force)


def test_exchanging_one_node_at_a_time_finds_the_same_contact(monkeypatch):
    """What is left when exchanging all wrong nodes goes round in circles."""
    case = case_of(65, **rough(3e-5))
    expected = convolved_contact(case)
    monkeypatch.setattr(normal, "PATIENCE", 0)
    found = convolved_contact(case)
    np.testing.assert_array_equal(found.contact, expected.contact)
    np.testing.assert_allclose(found.nodal_force, expected.nodal_force, atol=1e-12 * case.normal_load)


@pytest.mark.parametrize(
    ("most", "case", "ending"),
    [
        (1, case_of(**rough(1e-5)), Ending.CONTACT_NOT_CONVERGED),
        # Pressure moves nodes along the flanks ever further; the steepness is why, not the contact.
        (30, case_of(257, -0.5, FRICTIONLESS, normal_load=1e-2, **rough(1e-1, 401)), Ending.STEEP_PIN),
        # Nodes that pull on the way to a contact stay among numbers: each round would move them further along the flanks.
        (None, case_of(5, 0.0, FRICTIONLESS, radius=9.7e-12, normal_load=0.5, start=0.3), Ending.STEEP_PIN),
    ],
    ids=["rounds", "steep flanks", "pulling nodes"],
)
def test_a_contact_that_is_not_found_says_why(most, case, ending, monkeypatch):
    if most:
        monkeypatch.setattr(convolved, "MOST_ROUNDS", most)
    with np.errstate(all="raise", under="ignore"):
        assert convolved_contact(case).outcome.ending is ending


@pytest.mark.parametrize(
    ("n_x", "poisson", "normal_load", "slope"),
    [(65, -0.5, 1e-7, 0.7), (33, -0.99, 3e-10, 0.9), (65, 0.0, 3e-9, 0.9), (5, 0.0, 1e-7, 0.5)],
)
def test_nodes_that_move_by_less_than_rounding_are_at_rest(n_x, poisson, normal_load, slope):
    """Two nodes on the flanks of a wedge, whose heights are rounded by far more than 1e-13 of what a small load moves."""
    wedge = Heterogeneity(roughness=((-0.6, 0.6 * slope), (0.0, 0.0), (0.6, 0.6 * slope)))
    case = case_of(n_x, poisson, FRICTIONLESS, start=0.5, normal_load=normal_load, heterogeneity=wedge)
    assert convolved_contact(case).outcome.ok
    assert initial_contact(case, surface_compliance(case.slab)).outcome.ok


def test_a_punch_whose_node_moves_out_from_under_it_is_named():
    case = case_of(33, -0.9, FRICTIONLESS, pin="flat_punch", half_width=0.1, normal_load=1.0)
    assert convolved_contact(case).outcome == initial_contact(case, surface_compliance(case.slab)).outcome


SLAB = Slab(n_x=129, scheme="half_plane")
N, CONVOLUTION = SLAB.n_x, surface_compliance(SLAB).convolution
X, PLACES = np.linspace(-0.5, 0.5, N), np.arange(N)
CONTACTS = {
    "one node": PLACES == 64,
    "a node at the end": PLACES == 0,
    "one piece": np.abs(X) < 0.3,
    "the whole surface": np.abs(X) < 1.0,
    "spots": np.random.default_rng(2).random(N) < 0.3,
}
HEIGHTS = X**2 / 2 + 1e-3 * np.random.default_rng(3).standard_normal(N)
LOAD = 0.02


def pressed_to(contact, precision=1e-14):
    return press_by_convolution(CONVOLUTION, contact, HEIGHTS, np.where(contact, LOAD / contact.sum(), 0.0), precision)


@pytest.mark.parametrize("precision", [1e-14, 0.0])
@pytest.mark.parametrize("contact", CONTACTS.values(), ids=list(CONTACTS))
def test_forces_and_approach_are_those_of_a_dense_solve(contact, precision, monkeypatch):
    """To the precision asked for, times what the stiffest wave, of two spacings, makes of it: under 30. Rounding ends the steps
    where no sum reaches the precision: the forces are as good as they get, and no step makes them worse."""
    monkeypatch.setattr(convolved, "MOST_STEPS", 1000)
    found, nodes = pressed_to(contact, precision), np.flatnonzero(contact)
    block = SLAB.scheme.matrix(SLAB)[N:, N:][np.ix_(nodes, nodes)]
    border = np.ones((len(nodes), 1))
    system = np.block([[block, -border], [border.T, np.zeros((1, 1))]])
    *force, approach = np.linalg.solve(system, np.append(-HEIGHTS[nodes], LOAD))
    np.testing.assert_allclose(found.normal_force[contact], force, rtol=0.0, atol=3e-13)
    assert not found.normal_force[~contact].any()
    assert found.normal_force.sum() == pytest.approx(LOAD, rel=1e-13)
    assert found.approach == pytest.approx(approach, abs=1e-13)
    np.testing.assert_allclose(found.v[contact], HEIGHTS[contact], rtol=0.0, atol=1e-13)
    # The surface is where the forces press it.
    np.testing.assert_allclose(found.v, found.approach + CONVOLUTION.w(-found.normal_force), rtol=0.0, atol=1e-14)


def test_steps_do_not_grow_with_the_nodes(monkeypatch):
    """From 129 to 16 385 nodes, to 1e-13 of heights; plain conjugate gradients would need the root of that, 11 times as many."""
    taken, original = [], type(CONVOLUTION).w
    monkeypatch.setattr(type(CONVOLUTION), "w", lambda *given: taken.append(len(given[1])) or original(*given))
    for n_x in (129, 16_385):
        x = np.linspace(-0.5, 0.5, n_x)
        contact = np.abs(x) < 0.3
        start = np.where(contact, LOAD / contact.sum(), 0.0)
        press_by_convolution(
            surface_compliance(Slab(n_x=n_x, scheme="half_plane")).convolution, contact, x**2 / 2, start, 1e-13
        )
    assert taken.count(16_385) <= 2 * taken.count(129) <= 40
