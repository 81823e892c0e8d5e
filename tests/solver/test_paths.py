"""A contact along a path of pin displacement and load: bits of a record, the mirror, the laws, closed forms, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, Heterogeneity, Interface, SlipRule
from nanoslip.solver.contact.closed_forms import MindlinLoops
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Direction
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.solver.simulate import friction_path
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.path import loops_of
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import EVENT_TYPES
from nanoslip.solver.sliding.slide import run_way, slide, slide_to_state
from nanoslip.solver.sliding.way import Way
from tests.mirror import mirrored
from tests.physics import LIMITS, law_errors, stored_energy

W = 1e-3
METHODS = {
    "whole contact": {},
    "in rounds": {"slip_rule": SlipRule("simultaneous")},
    "constant pressures": {"effects": Effects(pin_translation=False)},
    "coulomb": {"slip_rule": SlipRule(residual_shear=1.0)},
}


def case_of(scheme="half_plane", n_x=33, **changes):
    return Case(slab=Slab(n_x=n_x, scheme=scheme), **changes)


def led(case, **path):
    return friction_path(replace(case, path=LoadPath(**path)))


@pytest.mark.parametrize("method", METHODS)
def test_a_leg_forward_has_the_bits_of_a_record(method):
    case = case_of("biquadratic", max_events=None, max_displacement=6e-4, start=0.3, **METHODS[method])
    (leg,), record = led(case, legs=((6e-4, 1.0),)).legs, slide(case, surface_compliance(case.slab))
    assert len(record.displacement) > 5
    for name in (*EVENT_TYPES, "node_slips", "final_force", "final_displacement", "presliding_length"):
        np.testing.assert_array_equal(getattr(leg, name), getattr(record, name))
    np.testing.assert_equal(plateau_of(leg).mean, plateau_of(record).mean)


def backward_and_mirrored(case, far):
    """A leg back over `far` after as long a way, in itself and as the record of the mirror image."""
    compliance = surface_compliance(case.slab)
    reach = replace(case, max_events=None, max_displacement=far)
    _, turn = slide_to_state(reach, compliance)
    back = run_way(case, compliance, turn, Way(W, Direction(-1.0, 0.0, -1), turn.displacement - 2 * far))
    return back, slide_to_state(reach, compliance, mirrored(turn))


@pytest.mark.parametrize(
    ("scheme", "method"),
    [
        *(("strip", method) for method in METHODS),
        *(
            pytest.param(scheme, "whole contact", marks=pytest.mark.slow)
            for scheme in ("biquadratic", "galerkin", "half_plane")
        ),
    ],
)
def test_backward_is_forward_in_a_mirror(scheme, method):
    """The same nodes, forces to 1e-12 of the load; on a surface without ends the grid goes on to the left, too."""
    case = case_of(scheme, max_events=10**6, **METHODS[method])
    back, (record, end) = backward_and_mirrored(case, 2e-3 if method == "whole contact" else 6e-4)
    assert len(record.displacement) > 20
    np.testing.assert_array_equal(back.record.node, case.slab.n_x - 1 - record.node)
    np.testing.assert_array_equal(back.record.slips, record.slips)
    np.testing.assert_allclose(back.record.displacement, -record.displacement, atol=1e-12 * W)
    for name in ("force_before", "force_after"):
        np.testing.assert_allclose(getattr(back.record, name), -getattr(record, name), atol=1e-12 * W)
    np.testing.assert_allclose(back.record.stiffness, record.stiffness, atol=1e-9)
    np.testing.assert_allclose(back.end.pressure, end.pressure[::-1], atol=1e-11 * end.pressure.max())


@pytest.mark.slow
def test_a_grid_without_ends_goes_on_to_the_left_as_to_the_right():
    """Rounding parts the last of 50,000 events: grids agree to a node, levels of friction within their scatter."""
    back, (record, end) = backward_and_mirrored(case_of("strip", max_events=10**6, radius=5.0), 0.6)
    assert back.end.first_node < -10
    assert abs(back.end.first_node + end.first_node) <= 1
    assert len(back.record.node_slips) > 33
    assert back.record.node_slips.sum() == back.record.slips.sum()
    # Ten stretches of each, so long that they hardly depend on each other: their scatter is the error of both levels.
    stretches = [np.abs(each.force_after[-20_000:]).reshape(10, -1).mean(axis=1) for each in (back.record, record)]
    errors = [each.std(ddof=1) / math.sqrt(10.0) for each in stretches]
    assert max(errors) < 5e-3 * stretches[0].mean()
    assert stretches[0].mean() == pytest.approx(stretches[1].mean(), abs=4.0 * math.hypot(*errors))
    broken = law_errors(back.end, back_case := case_of("strip", radius=5.0), surface_compliance(back_case.slab))
    assert {law for law, error in broken.items() if not error <= LIMITS[law]} == set()


def test_windows_of_a_rough_pin_go_on_in_both_directions():
    """There and back within windows as on the whole surface (the profile is its own mirror image, as the contact is)."""
    xi = np.linspace(-0.3, 0.3, 61)
    heights = 2e-5 * np.cos(400.0 * xi**2)
    rough = Heterogeneity(roughness=tuple(zip(xi.tolist(), heights.tolist(), strict=True)))
    case = case_of("galerkin", 65, heterogeneity=rough, max_events=10**6, radius=50.0)
    back, (record, _) = backward_and_mirrored(case, 1.5e-2)
    assert len(record.displacement) > 100
    np.testing.assert_array_equal(back.record.node, 64 - record.node)
    np.testing.assert_allclose(back.record.force_after, -record.force_after, atol=1e-9 * W)


def random_points(case, count, presliding_length, seed=1):
    """Points whose legs move the pin, change the load, or both."""
    rng, place, load = np.random.default_rng(seed), 0.0, 1.0
    for kind in rng.integers(3, size=count):
        to, then = rng.uniform(-3.0, 3.0) * presliding_length, float(np.exp(rng.uniform(-1.5, 0.7)))
        place, load = place if kind == 1 else to, load if kind == 0 else then
        yield place, load


def checked_legs(case, count):
    """Lead the case along random legs; laws and the balance of energy hold after each. The worst balance, as a share."""
    compliance = surface_compliance(case.slab)
    length = slide(replace(case, max_events=1), compliance).presliding_length
    state, worst, points = initial_contact(case, compliance), 0.0, tuple(random_points(case, count, length))
    for number in range(1, count + 1):
        path = friction_path(replace(case, path=LoadPath(legs=points[:number])), compliance)
        assert path.outcome.ok, path.outcome
        leg, under = path.legs[-1], replace(case, normal_load=path.legs[-1].normal_load)
        errors = law_errors(path.end, under, compliance)
        assert {law for law, error in errors.items() if not error <= LIMITS[law]} == set()
        x, force = leg.curve()
        work = float((force[1:] + force[:-1]) @ np.diff(x)) / 2
        missing = work + leg.load_work - leg.lost - (stored_energy(path.end) - stored_energy(state))
        worst, state = max(worst, abs(missing) / (abs(work) + abs(leg.load_work))), path.end
        assert (leg.load is None) == (leg.first_load == leg.normal_load)
    return worst


@pytest.mark.parametrize(
    ("scheme", "n_x", "count"),
    [
        ("half_plane", 17, 8),
        *(
            pytest.param(scheme, 65, 40, marks=pytest.mark.slow)
            for scheme in ("half_plane", "strip", "galerkin", "biquadratic")
        ),
    ],
)
def test_random_legs_obey_the_laws_and_balance_their_energy(scheme, n_x, count):
    """The paper's stencil is not reciprocal: its slab has no energy to balance."""
    missing = checked_legs(case_of(scheme, n_x, start=0.35), count)
    assert missing < 1e-11 or scheme == "biquadratic"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["half_plane", "strip"])
def test_random_legs_of_classical_sliding_obey_the_laws(scheme):
    """Energy to what the pin's curvature bends of forces between events, 1e-9 seen."""
    classical = SlipRule(residual_shear=1.0)
    assert checked_legs(case_of(scheme, 17, slip_rule=classical, intrinsic_friction=0.3, start=0.35), 4) < 1e-7


UNCOUPLED = {"effects": Effects(coupling=False), "initial_contact": "frictionless"}


def masing(n_x, amplitude):
    case = case_of(n_x=n_x, intrinsic_friction=0.05, slip_rule=SlipRule(residual_shear=1.0), **UNCOUPLED)
    path = led(case, amplitude=amplitude, cycles=2)
    virgin, down, up = path.legs[:3]
    return case, path, virgin, down, up


@pytest.mark.parametrize(("n_x", "close"), [(65, 0.05), pytest.param(257, 0.02, marks=pytest.mark.slow)])
def test_classical_loops_are_masings_with_the_closed_forms_loss(n_x, close):
    case, path, virgin, down, up = masing(n_x, 0.6)
    bearing = 0.05 * W
    q = virgin.final_force / bearing
    x, force = virgin.curve()
    half = np.linspace(0.0, x[-1], 50)
    back, falling = down.curve()
    want = force[-1] - 2.0 * np.interp(half, x, force)
    np.testing.assert_allclose(np.interp(x[-1] - 2.0 * half, back[::-1], falling[::-1]), want, atol=1e-6 * bearing)
    assert up.final_force == pytest.approx(virgin.final_force, rel=1e-9)
    form = MindlinLoops(virgin.initial_stiffness, case.slab.poisson, bearing)
    assert x[-1] == pytest.approx(form.amplitude(q), rel=close)
    found = loops_of(path)
    assert found.loss_per_cycle == pytest.approx(found.first_loss, rel=1e-6)
    assert found.loss_per_cycle == pytest.approx(form.loss(form.amplitude(q)), rel=close)
    # A closed loop's area is its loss.
    loop = np.concatenate([leg.curve() for leg in path.legs[-2:]], axis=1)
    area = float((loop[1, 1:] + loop[1, :-1]) @ np.diff(loop[0])) / 2
    assert area == pytest.approx(found.loss_per_cycle, rel=1e-3)
    assert found.closure < 1e-6
    assert found.shaken_down == 0.0
    labelled = path.to_xarray()
    assert labelled.loss_per_cycle * W == pytest.approx(found.loss_per_cycle)
    assert path.plot().get_xlabel()


def test_the_closed_form_of_loops_is_masings_integral_cubic_when_small_and_plastic_when_large():
    """Loss is 8 times the area between the virgin curve and its chord (Masing): 4 q g - 8 ∫ g; (2/3) B (μW)² q³ for small q."""
    form, share = MindlinLoops(1.8, 1.0 / 3.0, 5e-4), np.array([1e-4, 1e-3, 0.1, 0.6, 1.0])
    curve = np.linspace(0.0, 1.0, 200_001) * share[:, None]
    force = form.bearing * curve
    place = form.amplitude(curve)
    under = ((force[:, 1:] + force[:, :-1]) * np.diff(place)).sum(axis=1) / 2
    loss = 8 * (under - force[:, -1] * place[:, -1] / 2)
    np.testing.assert_allclose(form.loss(place[:, -1])[2:], loss[2:], rtol=1e-4)
    cubic = 2 / 3 * form.compliance * form.bearing**2 * share**3
    np.testing.assert_allclose(form.loss(place[:, -1])[:2], cubic[:2], rtol=1e-3)
    # Beyond sliding each turn adds its way at μW, four times in a cycle.
    most = place[-1, -1]
    assert form.loss(3 * most) - form.loss(most) == pytest.approx(4 * form.bearing * 2 * most)


@pytest.mark.parametrize(("direction", "slips"), [(0.45, False), (0.55, True)])
def test_oblique_loading_slips_only_above_the_coefficient(direction, slips):
    """dQ/dP below μ_i: nothing ever slips, nodes that touch on the way included (Mindlin and Deresiewicz); above, all slides."""
    case = case_of(n_x=65, normal_load=W / 20, max_events=1, **UNCOUPLED)
    compliance, loads = surface_compliance(case.slab), np.geomspace(1.0, 20.0, 60)
    stiffness = [slide(replace(case, normal_load=load * W / 20), compliance).initial_stiffness for load in loads]
    way = np.cumsum(direction * np.diff(loads) * W / 20 * 2 / (np.array(stiffness[1:]) + stiffness[:-1]))
    path = led(case, legs=tuple(zip(way.tolist(), loads[1:].tolist(), strict=True)))
    assert path.outcome.ok
    assert path.legs[-1].normal_load == pytest.approx(W)
    assert bool(sum(leg.slips.sum() for leg in path.legs)) is slips
    assert slips or path.legs[-1].final_force == pytest.approx(direction * W * 0.95, rel=0.01)


@pytest.mark.parametrize(("visited", "least", "most"), [(2.0, 0.97, 1.03), (0.8, 0.75, 0.87)])
def test_friction_remembers_the_lowest_load(visited, least, most):
    path = led(case_of("strip", 65), slid=3.0, visited_loads=(visited, 1.0))
    slid, *_, back = path.legs
    assert least < back.final_force / slid.final_force < most
    np.testing.assert_equal(back.displacement, 0.0)
    assert np.isnan(back.stiffness).all()


@pytest.mark.parametrize("before", [3e-9, 1e-10])
def test_a_node_about_to_leave_a_resting_contact_has_a_role(before):
    """Its limit of shear vanishes with its pressure, so that it slid, was dragged along, stuck, slid, and so on for ever.

    before: load above that at which it leaves, over W; the path visits it.
    """
    classical = case_of(radius=50.0, intrinsic_friction=0.4, slip_rule=SlipRule(residual_shear=1.0), **UNCOUPLED)
    falling = led(classical, slid=0.3, visited_loads=(1.5, 1.0)).legs[-1]
    leaves = float(falling.load[np.flatnonzero(falling.releases)[0]]) / W
    path = led(classical, slid=0.3, visited_loads=(1.5, leaves * (1.0 + before), 1.0))
    assert path.outcome.ok
    assert path.legs[-1].final_force == pytest.approx(falling.final_force, rel=1e-9)


def test_slabs_with_ends_shake_down_and_others_do_not():
    slab, strip = (loops_of(led(case_of(scheme, 129), amplitude=0.3)) for scheme in ("biquadratic", "strip"))
    assert (slab.shaken_down, strip.shaken_down) == (1.0, 0.0)
    assert slab.loss_per_cycle < 1e-6 * slab.first_loss
    assert 0.2 < strip.loss_per_cycle / strip.first_loss < 1.5


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"interface": Interface(contacts=3), "max_presliding": 2.0}, "contacts"),
        ({"slip_rule": SlipRule(limited_shear="forward")}, "limited_shear"),
        ({"effects": Effects(pin_translation=False)}, "pin_translation"),
        ({"effects": Effects(friction=False)}, "friction"),
        ({"intrinsic_friction": float("inf")}, "intrinsic_friction"),
    ],
)
def test_paths_that_a_case_cannot_follow_are_refused(changes, word):
    with pytest.raises(InvalidInput) as refused:
        case_of(path=LoadPath(amplitude=0.3, visited_loads=(2.0,)), **changes)
    assert (refused.value.key, *refused.value.beside) == ("path", word)


@pytest.mark.parametrize(
    "wrong",
    [
        {"amplitude": -1.0},
        {"cycles": 0},
        {"visited_loads": (0.0,)},
        {"legs": ((0.1, 0.0),)},
        {"amplitude": 0.1, "stroke": 0.1},
        {"legs": ((0.1, 1.0),), "slid": 1.0},
    ],
)
def test_paths_out_of_range_are_refused(wrong):
    with pytest.raises(InvalidInput):
        LoadPath(**wrong)


def test_an_empty_path_is_no_path():
    assert not LoadPath()
    assert not LoadPath(cycles=3)
    assert led(case_of()).legs == ()


HARD = {
    "load over four decades": (
        case_of("strip", 65),
        {"slid": 2.0, "visited_loads": (1e-4, 1.0, 1e-4, 1.0), "amplitude": 0.5},
    ),
    "tiny strokes": (case_of("strip", 65), {"amplitude": 1e-6}),
    "wide strokes": (case_of("strip", 65), {"amplitude": 20.0, "cycles": 1}),
    "past the end of the slab": (case_of("galerkin", 33), {"legs": ((3.0, 1.0), (0.0, 1.0))}),
    "two nodes": (case_of("galerkin", 33, radius=0.5, start=0.5), {"amplitude": 0.7}),
    "incompressible": (Case(slab=Slab(65, poisson=0.5, scheme="half_plane")), {"amplitude": 0.7}),
    "slippery": (case_of("strip", 65, intrinsic_friction=1e-3), {"amplitude": 0.7}),
    "sticky": (case_of("strip", 65, intrinsic_friction=3.0), {"amplitude": 0.7}),
    "punch": (case_of("galerkin", 65, pin="flat_punch"), {"amplitude": 0.7, "visited_loads": (0.5,)}),
}


@pytest.mark.parametrize("way", [{"amplitude": 1e-20, "slid": 1.0}, {"stroke": 1e-24, "slid": 1.0}])
def test_cycles_that_rounding_swallows_are_an_outcome(way):
    """One has no way at all beside where the pin has slid, the other is of two or three last digits."""
    path = led(case_of(n_x=9), cycles=2, **way)
    assert path.outcome.ending is Ending.ROUNDING
    assert path.outcome.message
    assert np.isnan(loops_of(path).secant_stiffness)


def test_a_loop_without_friction_at_its_turns_has_no_damping_ratio():
    """Every node drops to 0 at a turn, where energy has been lost: a ratio to no elastic energy."""
    strength_alone = SlipRule(strength=2e-18, event_floor=1.0)
    case = case_of("galerkin", 9, radius=1e4, normal_load=4e-7, intrinsic_friction=0.0, slip_rule=strength_alone)
    numbers = loops_of(led(case, amplitude=1.5, cycles=2))
    assert numbers.turn_friction == 0.0
    assert numbers.loss_per_cycle > 0.0
    assert np.isnan(numbers.equivalent_damping)


@pytest.mark.slow
@pytest.mark.parametrize("name", HARD)
def test_hard_paths_are_lawful_or_an_outcome(name):
    case, way = HARD[name]
    assert_lawful_or_named(led(case, **way), case)


def assert_lawful_or_named(path, case):
    """The laws hold where the path ends, to rounding of its largest load; one that broke off says why, with advice."""
    if not path.start.outcome.ok:
        assert path.outcome.message
        return
    last = path.legs[-1].normal_load if path.legs else case.normal_load
    errors = law_errors(path.end, replace(case, normal_load=last), surface_compliance(case.slab))
    scale = max(path.legs, key=lambda leg: leg.first_load).first_load / last if path.legs else 1.0
    assert {law for law, error in errors.items() if not error <= scale * LIMITS[law]} == set()
    assert path.legs if path.outcome.ok else path.outcome.message
    assert all(np.isfinite(leg.lost) and np.isfinite(leg.final_force) for leg in path.legs)


def random_scene(rng):
    """A case with a path of any kind."""
    friction, load = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in ((1e-3, 3.0), (1e-7, 1e-2)))
    length = friction * load  # a presliding length, at K = 1
    legs = zip((rng.uniform(-10.0, 10.0, 4) * length).tolist(), np.exp(rng.uniform(-3.0, 1.0, 4)).tolist(), strict=True)
    kinds = (
        {"amplitude": float(np.exp(rng.uniform(*np.log((1e-4, 10.0))))), "cycles": int(rng.integers(1, 4))},
        {"stroke": float(rng.uniform(0.1, 10.0)) * length, "cycles": 1, "slid": float(rng.uniform(0.0, 3.0))},
        {"slid": float(rng.uniform(0.1, 5.0)), "visited_loads": tuple(np.exp(rng.uniform(-6.0, 2.0, 3)).tolist())},
        {"legs": tuple(legs)},
    )
    return Case(
        slab=Slab(
            n_x=int(rng.choice([9, 17, 33])),
            scheme=str(rng.choice(["half_plane", "strip", "galerkin", "biquadratic", "chain"])),
            poisson=float(rng.uniform(0.0, 0.45)),
            aspect_ratio=float(rng.choice([1.0, 3.0])),
        ),
        intrinsic_friction=friction,
        radius=float(np.exp(rng.uniform(*np.log((1.0, 2000.0))))),
        normal_load=load,
        start=float(rng.uniform()),
        initial_contact=str(rng.choice(["stick", "frictionless", "gradual"])),
        slip_rule=SlipRule(str(rng.choice(["worst_first", "simultaneous"])), float(rng.choice([0.0, 0.5, 0.9]))),
        heterogeneity=Heterogeneity(spread=float(rng.choice([0.0, 0.2]))),
        path=LoadPath(**kinds[int(rng.integers(len(kinds)))]),
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_random_paths_are_lawful_or_an_outcome(seed):
    """400 scenes, ten a seed; most of them go all of their way."""
    rng, whole = np.random.default_rng(seed), 0
    for _ in range(10):
        case = random_scene(rng)
        path = friction_path(case)
        assert_lawful_or_named(path, case)
        whole += path.outcome.ok
    assert whole >= 4
