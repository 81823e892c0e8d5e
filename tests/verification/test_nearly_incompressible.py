"""Near ν = 0.5 surface nodes of finite elements give way together, which makes friction too high: the flag `unresolved_slab`."""

from functools import lru_cache

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.validity import Flag, contact_flags, predict_flags, record_flags
from tests.verification.seen import seen


@lru_cache
def compliance(slab: Slab) -> Compliance:
    return surface_compliance(slab)


def handed_over(slab: Slab) -> float:
    """Share of a middle node's shear that each of its neighbours takes over as it gives way, those near it held."""
    n, reach = slab.n_x, 8
    near = slice(n // 2 - reach, n // 2 + reach + 1)
    stiffness = np.linalg.inv(compliance(slab).matrix[near, near])
    return float(-stiffness[reach, reach + 1] / stiffness[reach, reach])


@pytest.mark.parametrize("n_x", [33, 129])
@pytest.mark.parametrize("aspect_ratio", [0.3, 1.0])
def test_elements_near_half_hand_over_more_than_was_held(n_x: int, aspect_ratio: float) -> None:
    """That it is the grid's doing the half-plane shows, where ν leaves the share alone."""
    shares = [handed_over(Slab(n_x, aspect_ratio, poisson)) for poisson in (1 / 3, 0.45, 0.48, 0.49, 0.495)]
    seen(
        "shear that each neighbour takes over, ν = 1/3 to 0.495",
        f"{n_x} nodes, height {aspect_ratio:g}",
        f"{np.round(shares, 2)}",
    )
    assert shares[0] < 0.5 < shares[1]
    assert np.all(np.diff(shares) > 0.0)
    assert shares[-1] > 0.65
    endless = [handed_over(Slab(65, poisson=poisson, scheme="half_plane")) for poisson in (1 / 3, 0.495)]
    assert endless == pytest.approx([0.44, 0.44], abs=0.005)


@pytest.mark.parametrize("n_x", [65, pytest.param(129, marks=pytest.mark.slow)])
def test_friction_that_is_too_high_is_flagged_and_other_is_not(n_x: int) -> None:
    """A half-plane's nodes hand over the same at any ν. At ν = 1/3 a slab as high as wide differs from it by 2 %."""

    def found(scheme: str, poisson: float) -> tuple[float, bool]:
        case = Case(normal_load=5e-4, slab=Slab(n_x, poisson=poisson, scheme=scheme), max_events=None, max_spacings=1.0)
        start = initial_contact(case, compliance(case.slab))
        record, end = slide_to_state(case, compliance(case.slab), start)
        every = (predict_flags(case, 0.1), contact_flags(case, start), record_flags(case, start, record, end))
        assert len({Flag.unresolved_slab in flags for flags in every}) == 1
        return plateau_of(record).mean, Flag.unresolved_slab in every[0]

    for poisson in (1 / 3, 0.38, 0.41, 0.44, 0.45, 0.49):
        slab, endless = found("galerkin", poisson), found("half_plane", poisson)
        assert not endless[1]
        assert slab[1] == (poisson > 0.38) == (slab[0] > 1.025 * endless[0])
