"""Cases that are one case in other units have one record: similarity in R and W, and the half-plane, which knows no length.

Each reduced model equals the full one in the limit where it should; the difference falls at the rate that is expected.
"""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.physics import coupled_half_plane
from tests.verification.seen import listed, seen

GOODMAN = Effects(pin_translation=False, coupling=False)


def test_frozen_pressures_are_right_while_the_pin_has_moved_little():
    """At a fixed contact width a (W·R fixed) the displacement of the n-th event is of the order of W, and so are the changes
    of pressure that frozen ones leave out: the first events differ by O(δ_p/a), until a near tie is settled otherwise."""
    compliance = surface_compliance(Slab(n_x=65, scheme="biquadratic"))
    found = []
    for normal_load in (1e-4, 1e-5, 1e-6):
        given = {"slab": compliance.slab, "max_events": 3, "effects": Effects(coupling=False)}
        case = Case(0.5, 0.2 / normal_load, normal_load, **given)
        full, frozen = slide(case, compliance), slide(replace(case, effects=GOODMAN), compliance)
        ratio = np.abs(full.displacement / frozen.displacement - 1.0).max()
        found.append(ratio)
        print(f"δ_p/a = {full.displacement[-1] / 0.29:.1e}: displacements of events differ by {ratio:.1e}")
    assert found[0] < 1e-3
    np.testing.assert_allclose(np.divide(found[1:], found[:-1]), 0.1, rtol=0.01)  # 0.1 in the limit


@pytest.mark.parametrize(
    "effects", [Effects(coupling=False), Effects(pin_translation=False), GOODMAN], ids=["coupling", "pin", "both"]
)
def test_what_leaves_coupling_out_is_right_near_poisson_one_half(effects):
    """On the half-plane the coupling is (1 - 2ν)/4, and the stuck contact's stiffness differs by its square; with coupling,
    frozen pressures leave it out after initial contact."""
    found = []
    for poisson in (0.45, 0.495, 0.4995):
        slab = Slab(n_x=65, poisson=poisson)
        case = Case(slab=slab, radius=100.0, intrinsic_friction=np.inf, max_events=None, max_displacement=1e-3)
        compliance = coupled_half_plane(slab)
        full = slide(case, compliance)
        plain = slide(replace(case, effects=effects), compliance)
        found.append(abs(plain.initial_stiffness / full.initial_stiffness - 1.0))
        print(f"ν = {poisson}: stiffness differs by {found[-1]:.1e}")
    assert found[0] < 1e-2
    np.testing.assert_allclose(np.divide(found[1:], found[:-1]), 0.01, rtol=0.2)  # 0.0116 and 0.0102 seen


SIMILAR = {"displacement": 1, "force_before": 1, "force_after": 1, "stiffness": 0, "dissipated": 2}
"""Columns of a record and the power of s by which they shrink when R grows to R·s and W falls to W/s."""
LIGHT = 1e-4
"""Light enough for the event floor to follow the load: 20·μ_i·W/K is below a node spacing."""


def cases(slab, residual_shear):
    """Contacts that scale exactly: their pin's height over a node does not change as the node slips.

    Elsewhere the height at x + s_i is meant, and s_i shrinks with W while x does not.
    """
    rule = SlipRule(residual_shear=residual_shear)
    parabola = Case(slab=slab, radius=0.2 / LIGHT, normal_load=LIGHT, max_events=1000, slip_rule=rule)
    return {
        "parabola, pressures kept, uncoupled": replace(parabola, effects=GOODMAN),
        "flat punch, all effects": replace(parabola, pin="flat_punch"),
    }


def similar(case, s):
    """R·s and W/s: the same contact width, and everything that the load moves divided by s."""
    return replace(case, radius=case.radius * s, normal_load=case.normal_load / s)


def difference(one, other, s):
    """Largest difference of a column of `other`, scaled back, as a share of that column's largest value."""
    off = [np.abs(getattr(other, name) * s**power - getattr(one, name)).max() for name, power in SIMILAR.items()]
    return max(float(gap / np.abs(getattr(one, name)).max()) for gap, name in zip(off, SIMILAR, strict=True))


@pytest.mark.parametrize("residual_shear", [0.0, 0.5])
@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane"])
def test_radius_and_load_scale_the_record(scheme, residual_shear):
    """Heights x²/2R, elastic displacements and forces are all divided by s, and so are tolerances and the event floor.

    A power of two scales a floating-point number without rounding: the same bits. Any other factor rounds each input once;
    1000 events with some 10 slips each pass that on: 1e-10 is 5e5 roundings of the largest number.
    """
    slab = Slab(n_x=65, scheme=scheme)
    compliance = surface_compliance(slab)
    for name, case in cases(slab, residual_shear).items():
        record = slide(case, compliance)
        assert record.outcome.ok
        assert len(record.node) == 1000
        others = {s: slide(similar(case, s), compliance) for s in (2.0, 1024.0, 2.0**20, 3.0)}
        off = {s: difference(record, other, s) for s, other in others.items()}
        figures = f"records differ by {', '.join(f'{gap:.0e} (s = {s:g})' for s, gap in off.items())}"
        line = seen(f"R·s, W/s: {name}, {scheme}, residual {residual_shear}", "linear elasticity", figures)
        for s, other in others.items():
            # Mirror twins of a symmetric contact tie; thirds, unlike halves, are rounded.
            twins = [np.minimum(each.node, case.slab.n_x - 1 - each.node) for each in (other, record)]
            np.testing.assert_array_equal(*twins, err_msg=line)
            np.testing.assert_array_equal(other.slips, record.slips, err_msg=line)
            assert off[s] == 0.0 or (s == 3.0 and off[s] < 1e-10), line


@pytest.mark.parametrize("way", ["stick", "frictionless"])
def test_a_pin_that_is_carried_along_scales_in_the_limit_of_small_loads(way):
    """With all effects the pin's height is taken at x + s_i, so that s_i/x is left: it falls in proportion to the load.

    Ten events, before a near tie can be settled otherwise; 1 % for what is quadratic in s_i/x.
    """
    slab = Slab(n_x=65)
    compliance = surface_compliance(slab)
    found = []
    for normal_load in (1e-5, 1e-6, 1e-7):
        case = Case(0.5, 0.2 / normal_load, normal_load, slab=slab, max_events=10, initial_contact=way)
        record, other = slide(case, compliance), slide(similar(case, 2.0), compliance)
        np.testing.assert_array_equal(other.node, record.node)
        found.append(float(np.abs(other.displacement * 2.0 / record.displacement - 1.0).max()))
    line = seen(f"R·2, W/2 with all effects, {way}", "limit W → 0", f"events differ by {listed(found)}")
    assert found[0] < 1e-2, line
    np.testing.assert_allclose(np.divide(found[1:], found[:-1]), 0.1, rtol=0.01, err_msg=line)


@pytest.mark.parametrize("depth", [2.0, 4.0])
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_a_half_plane_has_no_length_of_its_own(friction, depth):
    """All lengths halved on twice the nodes: R, W, δ_p (per L_x), node spacing and the depth of the datum; the nodes in contact
    are the same ones about the middle, and nothing knows of the slab's ends.

    Logarithms of spacing and depth are rounded apart, each entry of the compliance by some 1e-16; 2000 events of 19 nodes in
    contact make that 4e-13 at most; 5e-12 leaves an order of magnitude to another machine's logarithm.
    """
    coarse = Slab(n_x=65, scheme="half_plane", aspect_ratio=depth)
    fine = replace(coarse, n_x=129, aspect_ratio=depth / 2.0)
    case = Case(slab=coarse, intrinsic_friction=friction, normal_load=5e-4, radius=100.0, max_events=2000)
    half = replace(case, slab=fine, normal_load=case.normal_load / 2.0, radius=case.radius / 2.0)
    record, other = slide(case, surface_compliance(coarse)), slide(half, surface_compliance(fine))
    assert record.outcome.ok
    assert record.initial_contact_size == 19
    off = difference(record, other, 2.0)
    law = f"half-plane at half the size, μ_i = {friction}, depth {depth:g}"
    line = seen(law, "no length", f"{off:.0e} in 2000 events")
    np.testing.assert_array_equal(other.node - 32, record.node, err_msg=line)
    assert off < 5e-12, line
