"""A ball and a disc on a half-space against closed forms (Hertz, Mindlin, adhesion), and what a plane of nodes alone has."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, Interface, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import RESIDUAL_LIMIT, equilibrium_residual
from nanoslip.solver.contact.pin import node_friction
from nanoslip.solver.contact.state import contact_summary, contact_width
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.full_contact import compile_state
from nanoslip.solver.sliding.interface import batches
from nanoslip.solver.sliding.path import follow
from nanoslip.solver.sliding.slide import slide, slide_to_state
from nanoslip.solver.sliding.slider import portion, slider
from tests.physics import assert_contact_laws

A, R = 0.25, 200.0
OFF = {"start": 0.37, "start_y": 0.21}
"""A start that is on none of the grid's own lines of symmetry."""


def ball(n_x: int = 33, poisson: float = 1 / 3, **more) -> Case:
    """A ball whose contact has Hertz's radius A: 8, 12, 16 spacings at n_x = 33, 49, 65."""
    load = 8 * A**3 / (3 * R * (1 - poisson))
    slab = Slab(n_x, poisson=poisson, scheme="half_space")
    return Case(slab=slab, radius=R, normal_load=load, max_events=None, **{"max_presliding": 3.0, **OFF, **more})


def touched(case: Case):
    state = initial_contact(case, surface_compliance(case.slab))
    assert state.outcome.ok, state.outcome
    return state


@pytest.mark.parametrize("scheme", ["half_space", "layer"])
def test_the_equilibrium_residual_is_that_of_the_matrix_though_none_is_kept(scheme):
    """A window that reaches the grid's rim and one that does not; forces that are no equilibrium."""
    for n_x in (9, 17):
        case = Case(slab=Slab(n_x, scheme=scheme), radius=R, normal_load=1.2e-3 if n_x == 9 else 1e-4, **OFF)
        compliance = surface_compliance(case.slab)
        compiled = compile_state(case, compliance, touched(case), whole=n_x == 9)
        state, nodes = compiled.state, len(compiled.window)
        assert equilibrium_residual(state) < RESIDUAL_LIMIT
        state.response[:] = np.random.default_rng(1).standard_normal(2 * nodes + 1)
        both = np.concatenate((state.contact, state.contact))
        seen = compliance.window(compiled.window) @ np.where(both, state.response[:-1], 0.0)
        seen[nodes:] += state.response[-1]
        missing = np.where(both, state.inputs[:-1] - seen, seen - state.response[:-1])
        assert equilibrium_residual(state) > 1.0
        np.testing.assert_allclose(state.work[0, :-1], missing, rtol=0, atol=1e-12 * np.abs(missing).max())


@pytest.mark.parametrize("scheme", ["biquadratic", "strip", "half_space"])
def test_the_residual_adds_forces_in_the_order_of_nodes_on_every_processor(scheme):
    """A response is refined by it: sums in the order that fits a processor's vectors would be other bits on the next one."""
    case = Case(slab=Slab(17, scheme=scheme), radius=R, normal_load=1e-3, **OFF if scheme == "half_space" else {})
    compliance = surface_compliance(case.slab)
    compiled = compile_state(case, compliance, touched(case), whole=True)
    state, nodes = compiled.state, len(compiled.window)
    state.response[:] = np.random.default_rng(1).standard_normal(2 * nodes + 1)
    matrix, seen = compliance.window(compiled.window), np.zeros(2 * nodes)
    for node in np.flatnonzero(state.contact):
        # Products and sums of arrays are rounded one by one.
        seen += state.response[node] * matrix[:, node] + state.response[nodes + node] * matrix[:, nodes + node]
    seen[nodes:] += state.response[-1]
    both = np.concatenate((state.contact, state.contact))
    missing = np.where(both, state.inputs[:-1] - seen, seen - state.response[:-1])
    equilibrium_residual(state)
    np.testing.assert_array_equal(state.work[0, :-1], missing)


@pytest.mark.parametrize("coupling", [True, False])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_ball_without_friction_is_hertz_contact(poisson, coupling):
    """Radius, largest pressure, approach a²/R; with coupling pressure also draws the surface in under the ball."""
    case = ball(poisson=poisson, effects=Effects(friction=False, coupling=coupling))
    state, peak = touched(case), 3 * case.normal_load / (2 * math.pi * A**2)
    assert contact_width(state) / 2 == pytest.approx(A, rel=0.01)
    assert state.approach == pytest.approx(A**2 / R, rel=2e-3)
    assert contact_summary(state).maximum_pressure == pytest.approx(peak, rel=0.01)
    away = np.hypot(state.x - OFF["start"] / 32, state.y - OFF["start_y"] / 32)
    inside = away < 0.8 * A
    hertz = peak * np.sqrt(1 - (away[inside] / A) ** 2)
    np.testing.assert_allclose(state.pressure[inside], hertz, rtol=0.02)
    assert contact_summary(state).mean_pressure == pytest.approx(2 / 3 * peak, rel=0.02)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_the_stiffness_of_a_sticking_contact_is_mindlins(poisson):
    """K = 8aG/(2-ν), without coupling; 1.6 % off at worst, for a start on the grid's own symmetry."""
    case = ball(
        49,
        poisson,
        effects=Effects(coupling=False),
        intrinsic_friction=math.inf,
        max_displacement=1e-9,
        max_presliding=None,
    )
    assert slide(case, surface_compliance(case.slab)).initial_stiffness == pytest.approx(
        8 * A / (2 - poisson), rel=6e-3
    )


def along_y(slab: Slab) -> np.ndarray:
    """Displacements along y per force along x at all offsets: ν xy/r³ over 2π, whose primitive is -r."""
    corners = np.arange(2.0 * slab.n_x) - (slab.n_x - 0.5)
    primitive = -np.hypot(corners[:, None], corners)
    return slab.poisson * np.diff(np.diff(primitive, axis=0), axis=1) / (2 * np.pi * slab.spacing)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_an_adhering_disc_is_stiffer_than_a_smooth_one(poisson):
    """By (1-ν) ln(3-4ν)/(1-2ν) (Mossakovskii, Spence), held along y, too; with shear along x alone by less than half as much."""
    slab = Slab(33, poisson=poisson, scheme="half_space")
    compliance, n = surface_compliance(slab), slab.nodes
    under = np.flatnonzero(np.hypot(compliance.x - 0.37 / 32, compliance.y - 0.21 / 32) <= A)
    both, m = np.concatenate((under, under + n)), len(under)
    (xx, xz), (zx, zz) = compliance.entries(both, both).reshape(2, m, 2, m).transpose(0, 2, 1, 3)
    turned = under % 33 * 33 + under // 33  # x and y exchanged
    both = np.concatenate((turned, turned + n))
    (yy, yz), (zy, _) = compliance.entries(both, both).reshape(2, m, 2, m).transpose(0, 2, 1, 3)
    xy = along_y(slab)[32 + np.subtract.outer(under // 33, under // 33), 32 + np.subtract.outer(under % 33, under % 33)]
    held, none, one = np.block([[xx, xy, xz], [xy, yy, yz], [zx, zy, zz]]), np.zeros(2 * m), np.ones(m)
    smooth, along_x, adhering = (
        float(np.linalg.solve(matrix, np.concatenate((none, one))[-len(matrix) :])[-m:].sum())
        for matrix in (zz, np.block([[xx, xz], [zx, zz]]), held)
    )
    exact = (1 - poisson) * math.log(3 - 4 * poisson) / (1 - 2 * poisson)
    assert smooth * (1 - poisson) / (4 * A) == pytest.approx(1.0, rel=0.02)
    assert adhering / smooth == pytest.approx(exact, rel=5e-3)
    assert 0.35 < (along_x / smooth - 1) / (exact - 1) < 0.5


@pytest.mark.slow
def test_cattaneo_and_mindlin_in_partial_slip():
    """Coulomb without coupling: F/μW = 1 - (1 - δ/δ_s)^1.5, δ_s = 3μW(2-ν)/16aG, and the stick radius a (1 - F/μW)^(1/3)."""
    nu, mu = 0.3, 0.4
    case = ball(33, nu, effects=Effects(coupling=False), intrinsic_friction=mu, slip_rule=SlipRule(residual_shear=1.0))
    compliance, full = surface_compliance(case.slab), 3 * mu * case.normal_load * (2 - nu) / (16 * A)
    for share in (0.4, 0.8):
        _, end = slide_to_state(replace(case, max_presliding=None, max_displacement=share * full), compliance)
        expected = 1 - (1 - share) ** 1.5
        assert end.friction_force / (mu * case.normal_load) == pytest.approx(expected, rel=0.01)
        stuck = end.contact & (np.abs(end.shear) < mu * end.pressure * (1 - 1e-9))
        assert math.sqrt(stuck.sum() / math.pi) / 32 == pytest.approx(A * (1 - expected) ** (1 / 3), abs=0.5 / 32)


@pytest.mark.slow
def test_a_published_case_of_another_program():
    """Example `cattaneo` of CONTACT (repository eve70a/CONTACT), its reference output.

    Two equal bodies, ν = 0.42, G = 200, R = 50, are a rigid ball on a half-space of G = 100 without coupling; squares of 0.13333.
    Both shear directions are limited there, so shear differs a little where nodes slide.
    """
    width, shear_modulus, mu = 18 * 0.4 / 3, 100.0, 0.4
    slab = Slab(19, poisson=0.42, scheme="half_space")
    case = Case(
        mu, 50.0 / width, 9.1954 / (shear_modulus * width**2), slab, max_events=None, max_displacement=8.155e-3 / width
    )
    case = replace(case, effects=Effects(coupling=False), slip_rule=SlipRule(residual_shear=1.0))
    compliance = surface_compliance(slab)
    start = initial_contact(case, compliance)
    assert start.contact.sum() == 177
    assert start.approach * width == pytest.approx(0.01998, rel=5e-4)
    assert start.pressure.max() * shear_modulus == pytest.approx(4.393, rel=5e-4)
    _, end = slide_to_state(case, compliance, start)
    assert end.friction_force / (mu * case.normal_load) == pytest.approx(0.875, rel=3e-3)
    middle = slice(9 * 19 + 9, 17 * 19, 19)  # along x from the middle, at y = 0
    pressure, shear = start.pressure[middle] * shear_modulus, end.shear[middle] * shear_modulus
    np.testing.assert_allclose(pressure, [4.39, 4.35, 4.23, 4.03, 3.72, 3.28, 2.65, 1.44], atol=0.006)
    np.testing.assert_allclose(
        shear, [0.879, 0.895, 0.948, 1.09, 1.49, 1.31, 1.06, 0.576], rtol=0.04
    )  # the pin has moved on by 0.06 spacings
    stuck = end.contact & (np.abs(end.shear) < mu * end.pressure * (1 - 1e-9))
    assert abs(int(stuck.sum()) - 45) <= 4


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.37, 0.21)])
def test_a_record_obeys_all_laws_wherever_it_starts(start):
    case = ball(17, start=start[0], start_y=start[1])
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert_contact_laws(end, case, compliance)
    assert 0.4 < record.final_force / record.normal_load / 0.5 < 0.75


@pytest.mark.parametrize("nodes", [0.3, 1.0, 1.5])
def test_one_and_a_few_nodes_in_contact(nodes):
    """A contact as wide as these spacings."""
    case = ball(17, start=0.0, start_y=0.5, max_presliding=1.5)
    case = replace(case, radius=R * (nodes / 16 / A) ** 3)
    record, end = slide_to_state(case, surface_compliance(case.slab))
    assert record.outcome.ok
    assert_contact_laws(end, case, surface_compliance(case.slab))
    assert record.initial_contact_size <= 9


def test_a_contact_that_outgrows_the_grid_still_obeys_the_laws():
    case = replace(ball(9), radius=R * 12, max_presliding=1.0)
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert record.initial_contact_size > 64
    assert_contact_laws(end, case, compliance)


@pytest.mark.slow
def test_the_grid_follows_the_ball_and_a_record_far_along_repeats():
    """After whole spacings the ball meets the same surface: the force has that period once the start is forgotten."""
    case = replace(ball(17, poisson=0.3), max_presliding=None, max_spacings=12.0, normal_load=4e-3, radius=20.0)
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert end.first_node > 0
    assert end.first_node % 17 == 0
    assert len(record.node_x) == len(record.node_y) == len(record.node_slips) == 17 * 17 + end.first_node
    places = (np.arange(1.0, 1001.0) / 1000 + np.array([[9.0], [10.0]])) / 16
    force = np.interp(places, record.displacement, record.force_after) / record.normal_load
    assert force[0].mean() == pytest.approx(force[1].mean(), rel=0.02)


@pytest.mark.everyday(1)
@pytest.mark.parametrize(
    "path",
    [LoadPath(amplitude=0.8, cycles=2, visited_loads=(2.0, 1.0)), LoadPath(legs=((-0.3, 1.0), (0.1, 1.5), (0.1, 1.0)))],
)
def test_a_path_obeys_the_laws_at_every_turn_and_the_grid_follows_it_to_the_left(path):
    case = replace(ball(17, 0.3, path=path, heterogeneity=Heterogeneity(spread=0.1)), normal_load=4e-3, radius=20.0)
    compliance, states = surface_compliance(case.slab), []
    assert follow(case, compliance, states.append).outcome.ok
    for state in states:
        assert_contact_laws(state, replace(case, normal_load=state.normal_force), compliance)
    if path.legs:
        assert min(state.first_node for state in states) < 0
        assert not any(state.first_node % 17 for state in states)


@pytest.mark.parametrize("loads", ["equal", "exponential", "heights"])
def test_contacts_of_one_slider_add_up(loads):
    """K of equal contacts is that of one times their number; of others it is less, as a ~ W^(1/3) is concave."""
    case = ball(17, 0.3, interface=Interface(contacts=4, loads=loads))
    compliance = surface_compliance(case.slab)
    found = slider(case, (portion(case, compliance, *batch, Ensemble()) for batch in batches(4)))
    assert (found.record.outcome.ok, found.lost) == (True, 0)
    share = found.record.initial_stiffness / (4 * 8 * A / 1.7)
    assert share == pytest.approx(1.0, rel=0.02) if loads == "equal" else 0.7 < share < 1.0


def test_a_picture_of_a_contact_is_of_the_row_with_the_largest_pressure():
    state = touched(ball(17))
    shear, pressure = (line.get_ydata() for line in reversed(state.plot().lines))
    assert len(shear) == len(pressure) < 17
    assert pressure.max() == pytest.approx(state.pressure.max() / state.normal_force)


def test_friction_of_a_node_depends_on_its_column_and_row_alone():
    drawn = Heterogeneity(spread=0.3, seed=5)
    small, large = (node_friction(ball(n_x, heterogeneity=drawn)).reshape(n_x, n_x) for n_x in (9, 17))
    np.testing.assert_array_equal(small, large[:9, :9])
    moved = node_friction(ball(9, heterogeneity=drawn), 2 * 9).reshape(9, 9)
    np.testing.assert_array_equal(moved[:-2], small[2:])
    assert len(np.unique(small)) == 81


def test_starts_are_drawn_along_and_across():
    cases = [Ensemble(8).case(ball(), number) for number in range(8)]
    assert len({case.start for case in cases}) == len({case.start_y for case in cases}) == 8
    assert not any(Ensemble(8).case(Case(), number).start_y for number in range(8))


def test_what_needs_a_plane_or_is_not_computed_on_one_is_refused():
    for key, wrong in {
        "start_y": lambda: Case(start_y=0.3),
        "roughness": lambda: ball(heterogeneity=Heterogeneity(roughness=((0.0, 0.0), (0.1, 1e-6)))),
        "n_x": lambda: Slab(2049, scheme="half_space"),
        "support": lambda: Slab(9, support="frictionless", scheme="half_space"),
    }.items():
        with pytest.raises(InvalidInput) as refused:
            wrong()
        assert refused.value.key == key
