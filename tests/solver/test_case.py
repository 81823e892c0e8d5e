"""A case means one physics point: equal numbers are equal cases, and nonsense is refused by name, in its declaration's words."""

import math
import re
from dataclasses import dataclass
from typing import Literal

import pytest

from nanoslip.solver import parameter as of
from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.elasticity.schemes import Biquadratic, Galerkin
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Family, Quantity, Roughness, parameter, quantities, quantity, validate
from nanoslip.solver.slab import Slab


@dataclass(frozen=True, slots=True)
class Toy:
    whole: int = parameter(3, meaning="a whole number", least=1, most=10)
    share: float = parameter(0.5, meaning="a share", above=0.0, most=1.0)
    length: float | None = parameter(None, meaning="a length", above=0.0)
    far: float = parameter(1.0, meaning="a wide range", least=1e-12, most=1e24, also=(0.0, math.inf))
    word: Literal["a", "b"] = parameter("a", meaning="a word")
    on: bool = parameter(True, meaning="a switch")
    points: Roughness = parameter((), meaning="points")
    free: str = "no parameter"

    def __post_init__(self):
        validate(self)


@dataclass(frozen=True, slots=True)
class Other:
    share: float = parameter(0.1, meaning="another's share")


class Sweet:
    name = ""


SWEETS: Family[Sweet] = Family("sweet")


@SWEETS.register
@dataclass(frozen=True, slots=True)
class Cake(Sweet):
    name = "cake"
    layers: int = parameter(2, meaning="layers", least=1, most=9)

    def __post_init__(self):
        validate(self)


@SWEETS.register
@dataclass(frozen=True, slots=True)
class Fruit(Sweet):
    name = "fruit"


@dataclass(frozen=True)
class Made:
    plain: float = quantity("a number")
    called: float = quantity("another", "its_own_name", "m", per="length", ensemble=True)
    with_twin: float = quantity("a length", measure="L_x", si=of.Quantity("", "a length", "m", "length"))
    undeclared: float


def test_values_take_their_declared_type_and_equal_ones_are_one_case():
    toy = Toy(whole=4.0, share=1, points=[[0, 1], [1, 0.0]])
    assert repr((toy.whole, toy.share, toy.points)) == "(4, 1.0, ((0.0, 1.0), (1.0, 0.0)))"
    assert hash(toy) == hash(Toy(whole=4, share=1.0, points=((0.0, 1.0), (1.0, 0.0))))
    assert math.copysign(1.0, Toy(far=-0.0).far) == 1.0  # -0.0 and 0.0 are one number
    assert Case(radius=200, slab=Slab(n_x=129.0)) == Case(radius=200.0, slab=Slab(n_x=129))
    assert Slab(33, scheme="biquadratic") == Slab(33, scheme=Biquadratic(rows=6, first_spacing="equal"))
    graded = Slab(129, scheme=Galerkin(rows_per_level=2, coarsest_row=17, bottom_row=129))
    assert (Slab(129), hash(Slab(129))) == (graded, hash(graded))


def test_bounds_are_allowed_where_they_are_declared_so():
    for allowed in ({"share": 1.0}, {"length": None}, {"length": 1e9}, {"far": 0.0}, {"far": math.inf}):
        Toy(**allowed)


def _slab_of(**given):
    return Slab.of(given)


def _drive(**given):
    return Drive(1.0, 0.1, 1.0, 1.0, **given)


@pytest.mark.parametrize(
    ("kind", "given", "said"),
    [
        (Toy, {"whole": 0}, "whole = 0: needs 1 to 10"),
        (Toy, {"whole": 2.5}, "whole = 2.5: needs a whole number"),
        (Toy, {"whole": True}, "whole = true: needs a whole number"),
        (Toy, {"share": 0.0}, "share = 0.0: needs 0 < share ≤ 1"),
        (Toy, {"share": math.nan}, "share = nan: needs a number"),
        (Toy, {"share": "1"}, "share = '1': needs a number"),
        (Case, {"radius": "5 mm"}, "radius = '5 mm': needs a number without a unit"),
        (Toy, {"length": 0}, "length = 0.0: needs length > 0"),
        (Toy, {"length": math.inf}, "length = inf: needs length > 0"),
        (Toy, {"far": 1e25}, "far = 1e+25: needs 1e-12 ≤ far ≤ 1e24"),
        (Toy, {"word": "c"}, "word = 'c': needs one of a, b"),
        (Toy, {"word": ["a"]}, "word = ['a']: needs one of a, b"),
        (Toy, {"on": 1}, "on = 1: needs true or false"),
        (Toy, {"points": [1]}, "points = [1]: needs points of two numbers each"),
        (Toy, {"points": [(0, math.inf)]}, "points = [(0, inf)]: needs finite numbers"),
        (Slab, {"n_x": 3}, "n_x = 3"),
        (Slab, {"n_x": -1}, "n_x = -1"),
        (Slab, {"poisson": -1.0}, "poisson = -1.0"),
        (Slab, {"aspect_ratio": 0.0}, "aspect_ratio = 0.0"),
        (Slab, {"n_x": 33, "scheme": "toy"}, "scheme = 'toy': needs one of biquadratic, chain, galerkin, half_plane"),
        (Slab, {"n_x": 33, "scheme": "half_plane", "support": "right_side"}, "support = 'right_side': needs scheme"),
        (Slab, {"n_x": 33, "scheme": Biquadratic(rows=2)}, "rows = 2: needs 3 to 6 rows"),
        (Slab, {"n_x": 33, "scheme": Galerkin(rows_per_level=0)}, "rows_per_level = 0: needs 1 to 1024"),
        (Slab, {"n_x": 33, "scheme": Galerkin(coarsest_row=65)}, "coarsest_row = 65: needs 2^q + 1 from 3 to 33"),
        (Slab, {"n_x": 33, "scheme": Galerkin(coarsest_row=2)}, "coarsest_row = 2: needs 2^q + 1"),
        (Slab, {"n_x": 33, "scheme": Galerkin(bottom_row=10)}, "bottom_row = 10: needs 2^q + 1"),
        (Slab, {"n_x": 33, "scheme": Galerkin(2, 17, 9)}, "bottom_row = 9: needs at least coarsest_row = 17"),
        (_slab_of, {"first_spacing": "equal"}, "first_spacing = 'equal': needs scheme = \"biquadratic\""),
        (_slab_of, {"scheme": "biquadratic", "rows_per_level": 2}, 'rows_per_level = 2: needs scheme = "galerkin"'),
        (_slab_of, {"scheme": "half_plane", "coarsest_row": 5}, 'coarsest_row = 5: needs scheme = "galerkin"'),
        (Case, {"intrinsic_friction": -0.1}, "intrinsic_friction = -0.1"),
        (Case, {"normal_load": 0}, "normal_load = 0"),
        (Case, {"max_events": None}, "max_events = None with max_displacement = None with "),
        (Case, {"max_spacings": 0}, "max_spacings = 0.0: needs max_spacings > 0"),
        (Case, {"half_width": 0.6}, "half_width = 0.6"),
        (Case, {"start": 1.01}, "start = 1.01: needs 0 ≤ start ≤ 1"),
        (SlipRule, {"residual_shear": -0.1}, "residual_shear = -0.1"),
        (SlipRule, {"event_floor": 0.0}, "event_floor = 0.0"),
        (SlipRule, {"event_floor": 1e-20}, "event_floor = 1e-20: needs 1e-14"),
        (
            Heterogeneity,
            {"roughness": ((0.0, 0.0), (1e-18, 1e-6))},
            "roughness = (0.0, 1e-18): needs points at least 1e-12 apart",
        ),
        (Heterogeneity, {"roughness": ((0.0, 1e300), (0.1, 0.0))}, "roughness = "),
        (Drive.from_si, {"spring_stiffness": 0.0}, "spring_stiffness = 0.0"),
        (_drive, {"integrator": "rk4"}, "time_step = None"),
        (_drive, {"surface_compliance": 0}, "surface_compliance = 0: needs true or false"),
        (Scales, {"slab_width": 0}, "slab_width = 0"),
    ],
)
def test_what_is_not_allowed_is_refused_by_name_and_value_and_with_what_is(kind, given, said):
    with pytest.raises(InvalidInput, match=f"^{re.escape(said)}"):
        kind(**given)


@pytest.mark.parametrize(
    ("make", "given", "nearest"),
    [
        (Case.of, {"radus": 5.0}, "radius"),
        (Case.of, {"mu_i": 0.1}, "intrinsic_friction"),
        (Case.of, {"events": 50}, "max_events"),
        (Case.of, {"scheme": "chain", "leaf_stifness": 3.0}, "leaf_stiffness"),
        (Slab.of, {"nx": 33}, "n_x"),
        (Drive.of, {"spring_stiffness": 1.0, "damping_ratio": 0.1, "stage_velocity": 1e-3, "memry": True}, "memory"),
        (lambda given: Drive.from_si(**given), {"sprng_stiffness": 1.0}, "spring_stiffness"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest_one(make, given, nearest):
    with pytest.raises(InvalidInput, match=f"nearest: {nearest}$") as refusal:
        make(given)
    assert refusal.value.key == list(given)[-1]


def test_a_part_among_flat_parameters_is_refused():
    """Its parameters stand beside the case's own there; it would have to win over them, or lose."""
    with pytest.raises(InvalidInput, match=r"^slab: needs its parameters one by one here; Case\(slab=…\)"):
        Case.of({"slab": Slab(33)})


def test_declarations_are_found_by_type():
    assert list(of.declared(Toy)) == ["whole", "share", "length", "far", "word", "on", "points"]
    assert of.family_settings(Toy, Other)["share"] == (Toy, Other)
    assert of.field_choices(Literal["x", "y"] | None) == ("x", "y")
    assert of.field_choices(float) == ()


def test_a_member_of_a_family_is_made_of_flat_parameters_and_is_flat_again():
    cake = SWEETS.member({"sweet": "cake", "layers": 3, "somebody_elses": 1}, "fruit")
    assert cake == Cake(3)
    assert SWEETS.flat(cake) == {"sweet": "cake", "layers": 3}
    assert SWEETS.flat(Fruit()) == {"sweet": "fruit", "layers": None}
    assert SWEETS.member({}, "fruit") == Fruit()
    assert SWEETS.member({"sweet": Cake(4)}, "fruit") == Cake(4)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        *(({"sweet": name}, "needs one of cake, fruit$") for name in ("salt", "", None, 1, ["cake"])),
        ({"sweet": "fruit", "layers": 3}, r'^layers = 3: needs sweet = "cake"$'),
        ({"layers": 10}, "^layers = 10: needs 1 to 9$"),
    ],
)
def test_nobody_elses_name_or_settings_pass(given, said):
    with pytest.raises(InvalidInput, match=said):
        SWEETS.member(given, "cake")


def test_a_quantity_is_called_after_its_field_unless_it_has_a_name_and_its_twin_and_uncertainty_after_it():
    found, part = quantities(Made), quantities(Made, "part_")
    names = {"plain": "plain", "called": "its_own_name", "with_twin": "with_twin"}
    assert {key: each.name for key, each in found.items()} == names
    assert [each.name for each in part.values()] == ["part_plain", "its_own_name", "part_with_twin"]
    assert list(part) == ["part_plain", "part_called", "part_with_twin"]
    assert found["called"] == Quantity("its_own_name", "another", "m", "length", ensemble=True)
    assert part["part_with_twin"].si == Quantity("part_with_twin_si", "a length", "m", "length")
    assert [each.name for each in found["called"].beside] == ["its_own_name_uncertainty", "its_own_name_members"]
    assert found["called"].beside[0].per == "length"  # ± is scaled as its number is
    assert (found["plain"].si, found["plain"].beside) == (None, ())


def test_a_scale_that_no_dataset_knows_is_refused_where_it_is_declared():
    with pytest.raises(ValueError, match="per = 'load' of force"):
        quantity("a force", "force", per="load")
    assert all(quantity("a number", per=scale) for scale in of.SCALED)


@pytest.mark.parametrize("n_x", [5, 33, 4097])
@pytest.mark.parametrize("aspect_ratio", [1e-3, 0.25, 1.0, 100.0])
def test_the_default_grading_is_good_or_as_good_as_the_surface(n_x, aspect_ratio):
    slab = Slab(n_x, aspect_ratio).scheme
    assert slab.coarsest_row == n_x or slab.coarsest_row - 1 >= 16 / min(1.0, aspect_ratio)
    assert slab.bottom_row == min(n_x, 8 * (slab.coarsest_row - 1) + 1)
    assert Slab(n_x, aspect_ratio, scheme=Galerkin(bottom_row=3)).scheme.coarsest_row == 3
    assert Slab(n_x, aspect_ratio, scheme=Galerkin(coarsest_row=n_x)).scheme.bottom_row == n_x


def test_scales_give_the_units_of_the_paper():
    scales = Scales(slab_width=1e-3, slab_depth=1e-2, shear_modulus=1e10)
    assert scales.force == pytest.approx(1e5)  # so W = 100 N is 1e-3
    assert scales.stiffness == pytest.approx(1e8)
    assert scales.time(0.5) == pytest.approx(math.sqrt(0.5 / 1e8))
