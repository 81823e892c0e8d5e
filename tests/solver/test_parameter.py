"""A declaration says what is allowed, and what is not allowed is refused in its words."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import pytest

from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import Roughness, check, choices_of, declared, parameter, settings_of


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

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class Other:
    share: float = parameter(0.1, meaning="another's share")


def test_values_take_their_declared_type() -> None:
    toy = Toy(whole=4.0, share=1, points=[[0, 1], [1, 0.0]])  # type: ignore[arg-type]
    assert repr((toy.whole, toy.share, toy.points)) == "(4, 1.0, ((0.0, 1.0), (1.0, 0.0)))"
    assert hash(toy) == hash(Toy(whole=4, share=1.0, points=((0.0, 1.0), (1.0, 0.0))))
    assert math.copysign(1.0, Toy(far=-0.0).far) == 1.0  # -0.0 and 0.0 are one number


@pytest.mark.parametrize(
    "allowed", [{"share": 1.0}, {"length": None}, {"length": 1e9}, {"far": 0.0}, {"far": math.inf}]
)
def test_bounds_are_allowed_where_they_are_declared_so(allowed: dict[str, Any]) -> None:
    Toy(**allowed)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"whole": 0}, "whole = 0: needs 1 to 10"),
        ({"whole": 2.5}, "whole = 2.5: needs a whole number"),
        ({"whole": True}, "whole = True: needs a whole number"),
        ({"share": 0.0}, "share = 0.0: needs 0 < share ≤ 1"),
        ({"share": math.nan}, "share = nan: needs a number"),
        ({"share": "1"}, "share = '1': needs a number"),
        ({"length": 0}, "length = 0.0: needs length > 0"),
        ({"length": math.inf}, "length = inf: needs length > 0"),
        ({"far": 1e25}, "far = 1e+25: needs 1e-12 ≤ far ≤ 1e24"),
        ({"word": "c"}, "word = 'c': needs one of a, b"),
        ({"word": ["a"]}, "word = ['a']: needs one of a, b"),
        ({"on": 1}, "on = 1: needs true or false"),
        ({"points": [1]}, "points = [1]: needs pairs of numbers"),
        ({"points": [(0, math.inf)]}, "points = [(0, inf)]: needs finite numbers"),
    ],
)
def test_what_is_not_allowed_is_refused_with_the_value_and_what_is(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        Toy(**given)
    assert str(refusal.value).startswith(said)


def test_declarations_are_found_by_type() -> None:
    assert list(declared(Toy)) == ["whole", "share", "length", "far", "word", "on", "points"]
    assert settings_of(Toy, Other)["share"] == (Toy, Other)
    assert choices_of(Literal["x", "y"] | None) == ("x", "y")
    assert choices_of(float) == ()
