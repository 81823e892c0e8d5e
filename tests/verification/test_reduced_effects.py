"""Each reduced model equals the full one in the limit where it should; the difference falls at the rate that is expected."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import slide
from tests.physics import coupled_half_plane

GOODMAN = Effects(pin_translation=False, coupling=False)


def test_frozen_pressures_are_right_while_the_pin_has_moved_little() -> None:
    """At a fixed contact width a (W·R fixed) the displacement of the n-th event is of the order of W, and so are the changes
    of pressure that frozen ones leave out: the first events differ by O(δ_p/a), until a near tie is settled otherwise."""
    compliance = surface_compliance(Slab(n_x=65, scheme="biquadratic"))
    found = []
    for normal_load in (1e-4, 1e-5, 1e-6):
        case = Case(
            slab=compliance.slab,
            normal_load=normal_load,
            radius=0.2 / normal_load,
            max_events=3,
            effects=Effects(coupling=False),
        )
        full, frozen = slide(case, compliance), slide(replace(case, effects=GOODMAN), compliance)
        ratio = np.abs(full.displacement / frozen.displacement - 1.0).max()
        found.append(ratio)
        print(f"δ_p/a = {full.displacement[-1] / 0.29:.1e}: displacements of events differ by {ratio:.1e}")
    assert found[0] < 1e-3
    np.testing.assert_allclose(np.divide(found[1:], found[:-1]), 0.1, rtol=0.01)  # 0.1 in the limit


@pytest.mark.parametrize(
    "effects", [Effects(coupling=False), Effects(pin_translation=False), GOODMAN], ids=["coupling", "pin", "both"]
)
def test_what_leaves_coupling_out_is_right_near_poisson_one_half(effects: Effects) -> None:
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


def test_a_half_plane_is_right_for_contacts_small_beside_the_slab() -> None:
    """The same nodes in contact, half as wide each time: the sides' and the bottom's part of the peak pressure falls with
    (a/L_x)², to 0.24 and 0.20 of it here. (Stiffness has no such limit: a half-plane has no place at rest.)"""
    found = []
    for n_x, width in ((33, 1 / 4), (65, 1 / 8), (129, 1 / 16)):
        peaks = []
        for scheme in ("galerkin", "half_plane"):
            slab = Slab(n_x=n_x, scheme=scheme)
            normal_load = width**2 * np.pi / (2 * 50.0 * (1 - slab.poisson))  # a² = 2WR(1-ν)/π on a half-plane
            case = Case(slab=slab, radius=50.0, normal_load=normal_load, effects=Effects(friction=False))
            peaks.append(initial_contact(case, surface_compliance(slab)).pressure.max())
        found.append(abs(peaks[0] / peaks[1] - 1.0))
        print(f"a/L_x = {width}: peak pressures differ by {found[-1]:.1e}")
    assert found[0] < 0.05
    assert max(np.divide(found[1:], found[:-1])) < 0.3
