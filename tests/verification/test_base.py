"""Pressure and shear at the base of an incompressible film, by the closed form of docs/gallery/python/base.py."""

import ast
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import find_states, slide, slide_to_state
from tests.conftest import ROOT
from tests.verification.layer import wave_response
from tests.verification.seen import listed, seen

NODES = 513


def recipe():
    """The function `at_base` of docs/gallery/python/base.py, without the rest of the script."""
    script = ast.parse((ROOT / "docs" / "gallery" / "python" / "base.py").read_text("utf-8"))
    names = {"np": np}
    only = [part for part in script.body if isinstance(part, ast.FunctionDef)]
    exec(compile(ast.Module(only, []), "base.py", "exec"), names)
    return names["at_base"]


AT_BASE = recipe()


def waves(height, nodes=NODES, spacing=1 / NODES):
    """Height times the wavenumbers of a period of so many nodes."""
    return 2 * np.pi * height * np.fft.rfftfreq(nodes, spacing)


@pytest.mark.parametrize("number", [1, 3, 10, 40])
@pytest.mark.parametrize("height", [0.01, 0.05, 0.2])
def test_a_wave_comes_down_as_the_layers_equations_say(height, number):
    """Base stresses of the layer's four equations at ν = 1/2."""
    k, x = 2 * np.pi * number, np.arange(NODES) / NODES
    down = wave_response(k, height, 0.5, "bonded")[1]
    for shear, normal in ((1.0, 0.0), (0.0, 1.0), (0.7, -1.3)):
        below = down @ (shear, normal)
        p, q = AT_BASE(-normal * np.cos(k * x), shear * np.sin(k * x), waves(height))
        expected = [-below[1] * np.cos(k * x), below[0] * np.sin(k * x)]
        np.testing.assert_allclose([p, q], expected, atol=1e-13 * np.abs(expected).max() + 1e-15)


@pytest.mark.parametrize("height", [0.005, 0.01, 0.02])
def test_the_base_carries_load_friction_force_and_moment(height):
    """Forces to rounding; the drag acts a height above, so that the pressure's middle moves ahead by height·F/W."""
    x = np.arange(NODES) / NODES - 0.5
    pressure = np.sqrt(np.clip(1 - (x / 0.05) ** 2, 0, None))
    shear = pressure * (0.3 + 4 * x)
    p, q = AT_BASE(pressure, shear, waves(height))
    assert [p.sum(), q.sum()] == pytest.approx([pressure.sum(), shear.sum()], rel=1e-13)
    ahead, expected = (x @ p - x @ pressure) / p.sum(), height * shear.sum() / pressure.sum()
    seen("moment at a film's base", "equilibrium", f"pressure's middle ahead by {ahead:.8f}, expected {expected:.8f}")
    assert ahead == pytest.approx(
        expected, rel=1e-6
    )  # 5e-7 seen: coarse nodes at the smallest height, the period at the largest


def test_at_the_base_nodes_that_slip_look_like_amontons_law():
    """The recipe's pin on a coarser surface: ten moments of the slide beside Coulomb sliding with their mean friction, and
    beside the pressure of a contact at rest times that friction; largest differences over the largest stresses."""
    slab = Slab(193, 0.05, 0.5, scheme="strip")
    case, compliance = Case(1.0, 50.0, 1e-3, slab, max_events=100_000, max_presliding=4.0), surface_compliance(slab)
    record = slide(case, compliance)
    plateau = plateau_of(record)
    first, last = np.searchsorted(record.displacement, plateau.start) + 1, len(record.displacement)
    moments, outcome = find_states(case, compliance, [int(event) for event in np.linspace(first, last, 10)])
    assert outcome.ok
    coulomb = replace(case, intrinsic_friction=plateau.mean, slip_rule=SlipRule(residual_shear=1.0))
    _, sliding = slide_to_state(coulomb, compliance, initial_contact(coulomb, compliance))
    rest = initial_contact(replace(case, effects=Effects(friction=False)), compliance).pressure
    tractions = [(state.pressure, state.shear) for state in (sliding, *moments)]
    found = [AT_BASE(p, q, waves(0.05, slab.n_x, slab.spacing)) for p, q in (*tractions, (rest, plateau.mean * rest))]
    law, *each, at_rest = found
    differences = [np.abs(base - law).max(axis=1) / law.max(axis=1) for base in (np.mean(each, axis=0), *each, at_rest)]
    worst = np.max(differences[1:-1], axis=0)
    figures = f"mean {listed(differences[0])}, one moment {listed(worst)}, pressure at rest {listed(differences[-1])}"
    line = seen("pressure and shear at a film's base: nodes that slip", "Amontons' law", figures)
    assert np.all(differences[0] < 0.02), line
    assert np.all(worst < 0.06), line
    assert np.all(differences[-1] > 0.2), line
    assert law[0].argmax() > at_rest[0].argmax(), line
