"""A member of a family is known by its name and has its own settings; nobody else's name or settings pass."""

from dataclasses import dataclass

import pytest

from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Family, check, parameter


class Sweet:
    """What the members of this family are."""

    name = ""


SWEETS: Family[Sweet] = Family("sweet")


@SWEETS.register()
@dataclass(frozen=True, slots=True)
class Cake(Sweet):
    name = "cake"
    layers: int = parameter(2, meaning="layers", least=1, most=9)

    def __post_init__(self) -> None:
        check(self)


@SWEETS.register()
@dataclass(frozen=True, slots=True)
class Fruit(Sweet):
    name = "fruit"


def test_a_member_is_made_of_flat_parameters_and_is_flat_again() -> None:
    cake = SWEETS.member({"sweet": "cake", "layers": 3, "somebody_elses": 1}, "fruit")
    assert cake == Cake(3)
    assert SWEETS.flat(cake) == {"sweet": "cake", "layers": 3}
    assert SWEETS.flat(Fruit()) == {"sweet": "fruit", "layers": None}
    assert SWEETS.member({}, "fruit") == Fruit()
    assert SWEETS.member({"sweet": Cake(4)}, "fruit") == Cake(4)


@pytest.mark.parametrize("name", ["salt", "", None, 1, ["cake"]])
def test_a_name_that_nobody_registered_never_becomes_another_member(name: object) -> None:
    with pytest.raises(InvalidInput, match=r"needs one of cake, fruit$"):
        SWEETS.member({"sweet": name}, "fruit")


def test_the_settings_of_another_member_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r'^layers = 3: needs sweet = "cake"$'):
        SWEETS.member({"sweet": "fruit", "layers": 3}, "cake")
    with pytest.raises(InvalidInput, match=r"^layers = 10: needs 1 to 9$"):
        SWEETS.member({"layers": 10}, "cake")
