"""A case means one physics point: equal numbers are equal cases, and nonsense is refused by name."""

import math
import re

import pytest

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.elasticity.schemes import Biquadratic, Galerkin
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.slab import Slab


def test_whole_numbers_and_reals_make_the_same_case() -> None:
    assert Case(radius=200, normal_load=1e-3) == Case(radius=200.0, normal_load=1e-3)
    assert Slab(n_x=129.0) == Slab(n_x=129)  # type: ignore[arg-type]


def test_a_default_spelled_out_makes_the_same_slab() -> None:
    assert Slab(33, scheme="biquadratic") == Slab(33, scheme=Biquadratic(rows=6, first_spacing="equal"))
    graded = Slab(129, scheme=Galerkin(rows_per_level=2, coarsest_row=17, bottom_row=129))
    assert Slab(129) == graded
    assert hash(Slab(129)) == hash(graded)


def test_each_scheme_takes_its_own_numbers_only() -> None:
    with pytest.raises(InvalidInput, match='rows = 6: needs scheme = "biquadratic"'):
        Slab.of({"n_x": 33, "rows": 6})
    with pytest.raises(InvalidInput, match="first_spacing = 'equal': needs scheme = \"biquadratic\""):
        Slab.of({"n_x": 33, "first_spacing": "equal"})
    with pytest.raises(InvalidInput, match='rows_per_level = 2: needs scheme = "galerkin"'):
        Slab.of({"n_x": 33, "scheme": "biquadratic", "rows_per_level": 2})
    with pytest.raises(InvalidInput, match='coarsest_row = 5: needs scheme = "galerkin"'):
        Slab.of({"n_x": 33, "scheme": "half_plane", "coarsest_row": 5})
    with pytest.raises(InvalidInput, match="scheme = 'toy': needs one of biquadratic, chain, galerkin, half_plane"):
        Slab(33, scheme="toy")
    with pytest.raises(InvalidInput, match="support = 'right_side': needs scheme"):
        Slab(33, scheme="half_plane", support="right_side")


@pytest.mark.parametrize("n_x", [5, 33, 4097])
@pytest.mark.parametrize("aspect_ratio", [1e-3, 0.25, 1.0, 100.0])
def test_the_default_grading_is_good_or_as_good_as_the_surface(n_x: int, aspect_ratio: float) -> None:
    slab = Slab(n_x, aspect_ratio).scheme
    assert slab.coarsest_row is not None
    assert slab.bottom_row is not None
    assert slab.coarsest_row == n_x or slab.coarsest_row - 1 >= 16 / min(1.0, aspect_ratio)
    assert slab.bottom_row == min(n_x, 8 * (slab.coarsest_row - 1) + 1)
    assert Slab(n_x, aspect_ratio, scheme=Galerkin(bottom_row=3)).scheme.coarsest_row == 3
    assert Slab(n_x, aspect_ratio, scheme=Galerkin(coarsest_row=n_x)).scheme.bottom_row == n_x


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Slab(n_x=100), "n_x = 100"),
        (lambda: Slab(n_x=3), "n_x = 3"),
        (lambda: Slab(n_x=-1), "n_x = -1"),
        (lambda: Slab(n_x=True), "n_x = True"),
        (lambda: Slab(n_x=33.5), "n_x = 33.5"),  # type: ignore[arg-type]
        (lambda: Slab(poisson=0.5), "poisson = 0.5"),
        (lambda: Slab(poisson=-1.0), "poisson = -1.0"),
        (lambda: Slab(aspect_ratio=0.0), "aspect_ratio = 0.0"),
        (lambda: Slab(n_x=33, scheme=Biquadratic(rows=7)), "rows = 7: needs 3 to 6 rows"),
        (lambda: Slab(n_x=33, scheme=Biquadratic(rows=2)), "rows = 2: needs 3 to 6 rows"),
        (lambda: Slab(n_x=33, scheme=Galerkin(rows_per_level=0)), "rows_per_level = 0: needs 1 to 1024"),
        (lambda: Slab(n_x=33, scheme=Galerkin(coarsest_row=65)), "coarsest_row = 65: needs 2^q + 1 from 3 to 33"),
        (lambda: Slab(n_x=33, scheme=Galerkin(coarsest_row=2)), "coarsest_row = 2: needs 2^q + 1"),
        (lambda: Slab(n_x=33, scheme=Galerkin(bottom_row=10)), "bottom_row = 10: needs 2^q + 1"),
        (
            lambda: Slab(n_x=33, scheme=Galerkin(coarsest_row=17, bottom_row=9)),
            "bottom_row = 9: needs at least coarsest_row = 17",
        ),
        (lambda: Slab(support="glued"), "support = 'glued'"),  # type: ignore[arg-type]
        (lambda: Case(intrinsic_friction=-0.1), "intrinsic_friction = -0.1"),
        (lambda: Case(intrinsic_friction=math.nan), "intrinsic_friction = nan"),
        (lambda: Case(radius=-5), "radius = -5"),
        (lambda: Case(normal_load=0), "normal_load = 0"),
        (lambda: Case(normal_load="1"), "normal_load = '1'"),  # type: ignore[arg-type]
        (lambda: Case(max_events=None), "max_events, max_displacement, max_presliding and max_spacings"),
        (lambda: Case(half_width=0.6), "half_width = 0.6"),
        (lambda: SlipRule(residual_shear=1.5), "residual_shear = 1.5"),
        (lambda: SlipRule(residual_shear=-0.1), "residual_shear = -0.1"),
        (lambda: SlipRule(event_floor=0.0), "event_floor = 0.0"),
        (lambda: SlipRule(event_floor=1e-20), "event_floor = 1e-20: needs 1e-14"),
        (lambda: Case(start=1.01), "start = 1.01: needs 0 ≤ start ≤ 1"),
        (lambda: Case(max_spacings=0), "max_spacings = 0.0: needs max_spacings > 0"),
        (lambda: Heterogeneity(roughness=((0.0, 0.0), (1e-18, 1e-6))), "needs points at least 1e-12 apart"),
        (
            lambda: Heterogeneity(roughness=((0.0, 1e300), (0.1, 0.0))),
            "(0.0, 1e+300): needs |ξ| and |height| up to 1e+06",
        ),
        (lambda: Drive(0.0, 0.1, 1.0, 1.0), "spring_stiffness = 0.0"),
        (lambda: Drive(1.0, 0.1, 1.0, 1.0, integrator="rk4"), "time_step = None"),
        (lambda: Drive(1.0, 0.1, 1.0, 1.0, surface_compliance=0), "surface_compliance = 0: needs true or false"),  # type: ignore[arg-type]
        (lambda: Scales(slab_width=0), "slab_width = 0"),
    ],
)
def test_a_value_out_of_range_is_refused_by_name_and_value(make: object, name: str) -> None:
    with pytest.raises(InvalidInput, match=re.escape(name)):
        make()  # type: ignore[operator]


def test_scales_give_the_units_of_the_paper() -> None:
    scales = Scales(slab_width=1e-3, slab_depth=1e-2, shear_modulus=1e10)
    assert scales.force == pytest.approx(1e5)  # so W = 100 N is 1e-3
    assert scales.stiffness == pytest.approx(1e8)
    assert scales.time(0.5) == pytest.approx(math.sqrt(0.5 / 1e8))
    assert scales.energy == pytest.approx(scales.force * scales.slab_width)
