"""A digit more costs at most a hundred times as much, and what is stated is what is found."""

import pytest

from solver.case import Case
from solver.slab import Slab
from study.accuracy.digits import KINETIC, PLATEAU, Price, as_markdown, exponent, prices

TARGETS = (0.03, 0.01, 0.003)


@pytest.fixture(scope="module")
def found() -> list[Price]:
    return list(prices(Case(slab=Slab(65)), TARGETS, 3.0))


@pytest.mark.parametrize("observable", [PLATEAU, KINETIC])
def test_every_start_gets_to_its_target_and_is_as_right_as_it_says(found: list[Price], observable: str) -> None:
    own = [each for each in found if each.observable == observable]
    assert [each.target for each in own] == list(TARGETS)
    for each in own:
        assert each.reached == 1.0
        assert each.stated <= each.target
        assert each.error < 2.0 * each.stated  # of eight starts; 0.4 to 1.1 seen
    assert [each.spacings for each in own] == sorted(each.spacings for each in own)


def test_cost_falls_with_the_square_root_or_better(found: list[Price]) -> None:
    """Uncertainty falls as the root of a record's length where spacings are independent, and as its inverse at first."""
    for observable in (PLATEAU, KINETIC):
        assert exponent([each for each in found if each.observable == observable]) < 2.0


def test_the_exponent_is_the_slope_of_logarithms() -> None:
    rows = [Price(PLATEAU, target, 1.0, 1.0, 3.0 / target**1.5, target, target) for target in TARGETS]
    missed = Price(PLATEAU, 1e-4, 0.5, 1.0, 1.0, 1e-3, 1e-3)
    assert exponent([*rows, missed]) == pytest.approx(1.5, rel=1e-12)
    text = as_markdown({"a case": [*rows, *(Price(KINETIC, *vars_of(each)) for each in rows)]})
    assert "## plateau, a case\n\nCost ∝ uncertainty^-1.5." in text
    assert "| 3.00% | 100% | 1 |" in text


def vars_of(price: Price) -> tuple[float, ...]:
    return price.target, price.reached, price.spacings, price.seconds, price.stated, price.error
