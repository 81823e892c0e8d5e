"""The bonded layer in three dimensions: its limits are a half-space and films, and it is the strip under lines of forces."""

import math

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.state import contact_width
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide_to_state
from tests.physics import assert_contact_laws

POISSON = [-0.3, 0.0, 0.3, 0.49]


@pytest.mark.parametrize("poisson", POISSON)
def test_under_uniform_tractions_it_deforms_as_a_layer_between_plates(poisson):
    """w = p H (1-2ν)/(2(1-ν)), u = q H; on a square of 16 heights the ends are not felt in its middle."""
    slab = Slab(65, 1 / 16, poisson, scheme="layer")
    compliance, middle = surface_compliance(slab), slab.nodes // 2
    force = np.full((2, slab.nodes), slab.spacing**2)
    moved = compliance.displacements(force, coupled=False)[:, middle]
    expected = np.array([1.0, (1 - 2 * poisson) / (2 * (1 - poisson))])
    np.testing.assert_allclose(moved / slab.aspect_ratio, expected, atol=3e-3)


@pytest.mark.parametrize("poisson", POISSON)
def test_a_line_of_forces_across_moves_it_as_the_strip(poisson):
    """Nodes along y loaded alike over many heights; a strip's node bears a hat, not a uniform traction, so not under itself."""
    height, n = 0.06, 101
    layer, strip = (surface_compliance(Slab(n, height, poisson, scheme=scheme)) for scheme in ("layer", "strip"))
    force = np.zeros((2, n, n))
    force[:, n // 2] = layer.slab.spacing  # 1 per unit depth
    moved = layer.displacements(force.reshape(2, -1)).reshape(2, n, n)[:, :, n // 2]
    line = np.zeros((2, n))
    line[:, n // 2] = 1.0
    expected = strip.displacements(line)
    apart = np.abs(np.arange(n) - n // 2) >= 3
    np.testing.assert_allclose(moved[:, apart], expected[:, apart], atol=5e-3 * np.abs(expected).max())


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_it_is_an_elastic_body_and_a_half_space_if_it_is_high(poisson):
    high, low, half = (
        surface_compliance(Slab(13, height, poisson, scheme=scheme)).matrix
        for height, scheme in ((1e3, "layer"), (0.2, "layer"), (1.0, "half_space"))
    )
    np.testing.assert_allclose(high, half, atol=2e-3 * half.max())
    np.testing.assert_array_equal(low, low.T)
    assert np.linalg.eigvalsh(low)[0] > 0.05 * low.max()


def test_a_film_under_a_ball_is_a_bed_of_springs():
    """W = π k a⁴/4R and approach a²/2R, k = 2(1-ν)/((1-2ν)H), a = 5 heights: within 10 and 20 %, as its edge is half a height."""
    height, poisson, a = 0.05, 0.0, 0.25
    load = math.pi * 2 / height * a**4 / (4 * 1e5)
    case = Case(0.0, 1e5, load, Slab(65, height, poisson, scheme="layer"), initial_contact="frictionless")
    state = initial_contact(case, surface_compliance(case.slab))
    assert state.outcome.ok
    assert contact_width(state) / 2 == pytest.approx(a, rel=0.1)
    assert state.approach == pytest.approx(a**2 / (2 * 1e5), rel=0.2)


def test_a_record_on_a_soft_layer_obeys_the_laws():
    case = Case(0.5, 200.0, 3e-4, Slab(17, 0.2, 0.5, scheme="layer"), start=0.3, start_y=0.7, max_events=300)
    compliance = surface_compliance(case.slab)
    record, end = slide_to_state(case, compliance)
    assert record.outcome.ok
    assert_contact_laws(end, case, compliance)


def test_a_support_without_friction_or_a_film_thinner_than_its_nodes_are_apart_is_refused():
    for key, wrong in {"support": {"support": "frictionless"}, "aspect_ratio": {"aspect_ratio": 0.1}}.items():
        with pytest.raises(InvalidInput) as refused:
            Slab(9, scheme="layer", **wrong)
        assert refused.value.key == key
    film = Slab(n_x=9, aspect_ratio=0.125, scheme="layer")
    assert film.aspect_ratio == film.spacing
