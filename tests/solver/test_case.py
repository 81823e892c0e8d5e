"""A case means one physics point: equal numbers are equal cases, and nonsense is refused by name."""

import math

import pytest

from solver.case import Case, Drive, Scales, Slab, SlipRule
from solver.outcome import InvalidInput


def test_whole_numbers_and_reals_make_the_same_case() -> None:
    assert Case(radius=200, load=1e-3) == Case(radius=200.0, load=1e-3)
    assert Slab(n_x=129.0) == Slab(n_x=129)  # type: ignore[arg-type]
    assert Slab(n_x=33, rows=None) == Slab(n_x=33, rows=6)


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
        (lambda: Slab(n_x=33, rows=7), "rows = 7"),
        (lambda: Slab(n_x=33, rows=2), "rows = 2"),
        (lambda: Slab(support="glued"), "support = 'glued'"),  # type: ignore[arg-type]
        (lambda: Case(intrinsic_friction=-0.1), "intrinsic_friction = -0.1"),
        (lambda: Case(intrinsic_friction=math.nan), "intrinsic_friction = nan"),
        (lambda: Case(radius=-5), "radius = -5"),
        (lambda: Case(load=0), "load = 0"),
        (lambda: Case(load="1"), "load = '1'"),  # type: ignore[arg-type]
        (lambda: Case(max_events=None), "max_events and max_displacement"),
        (lambda: Case(half_width=0.6), "half_width = 0.6"),
        (lambda: SlipRule(residual=1.5), "residual = 1.5"),
        (lambda: SlipRule(residual=-0.1), "residual = -0.1"),
        (lambda: SlipRule(event_floor=0.0), "event_floor = 0.0"),
        (lambda: Drive(0.0, 0.1, 1.0, 1.0), "spring_stiffness = 0.0"),
        (lambda: Drive(1.0, 0.1, 1.0, 1.0, integrator="rk4"), "time_step = None"),
        (lambda: Drive(1.0, 0.1, 1.0, 1.0, surface_compliance=0), "surface_compliance = 0: needs true or false"),  # type: ignore[arg-type]
        (lambda: Scales(slab_width=0), "slab_width = 0"),
    ],
)
def test_a_value_out_of_range_is_refused_by_name_and_value(make: object, name: str) -> None:
    with pytest.raises(InvalidInput, match=name.replace("(", r"\(")):
        make()  # type: ignore[operator]


def test_scales_give_the_units_of_the_paper() -> None:
    scales = Scales(slab_width=1e-3, slab_depth=1e-2, shear_modulus=1e10)
    assert scales.force == pytest.approx(1e5)  # so W = 100 N is 1e-3
    assert scales.stiffness == pytest.approx(1e8)
    assert scales.time(0.5) == pytest.approx(math.sqrt(0.5 / 1e8))
    assert scales.energy == pytest.approx(scales.force * scales.slab_width)
