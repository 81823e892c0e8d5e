"""What limits a case's accuracy: the largest first, each with what halves it and what that costs."""

import math
from dataclasses import replace

import pytest

from solver.case import Case, Heterogeneity
from solver.slab import Slab
from study.discretization.front import load_front
from study.plan.cost.sliding import expected_displacement
from study.plan.influence.decision import Tolerance, decide
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.limits import Limit, limits_of
from study.plan.influence.scene import ASKED_FOR
from tests.study.plan.influence.made_up import GRAVE, SLIGHT, influences

CASE = Case(slab=Slab(65), max_events=2000)


def limits(
    case: Case, within: float = 0.0, slides: bool = True, asked: tuple[str, ...] = ASKED_FOR["slip"]
) -> dict[str, Limit]:
    known = influences(SLIGHT if within else GRAVE)
    tolerance = Tolerance(within or 1e-3, asked, frozenset({WHOLE_LENGTH}), known, slides, False, 1.0)
    found = limits_of(decide(case, {}, {}, tolerance), tolerance, load_front())
    known_sizes = [each.size for each in found if math.isfinite(each.size)]
    assert known_sizes == sorted(known_sizes, reverse=True)
    return {each.what: each for each in found}


def test_what_slides_on_a_grid_is_limited_by_grid_and_length() -> None:
    assert set(limits(CASE)) == {"grid", "length of the record"}
    assert set(limits(CASE, slides=False)) == {"grid"}


@pytest.mark.parametrize("asked", ["static_friction", "peak_friction"])
def test_a_number_of_one_event_is_limited_by_the_start_however_long_the_record(asked: str) -> None:
    short, long = (limits(replace(CASE, max_events=events), asked=(asked,)) for events in (2000, 20000))
    assert short["start of the pin"] == long["start of the pin"]
    assert short["start of the pin"].costs == 4.0  # a scatter over the root of the members
    fewer = limits(replace(CASE, radius=20.0), asked=(asked,))["start of the pin"]
    assert fewer.size > short["start of the pin"].size  # fewer nodes in contact


def test_a_draw_of_friction_limits_it_and_four_times_the_members_halve_that() -> None:
    drawn = limits(replace(CASE, heterogeneity=Heterogeneity(spread=0.1)))["draw of the nodes' μ_i"]
    wider = limits(replace(CASE, heterogeneity=Heterogeneity(spread=0.2)))["draw of the nodes' μ_i"]
    assert wider.size == pytest.approx(2.0 * drawn.size, rel=1e-9)
    assert drawn.costs == 4.0


def test_what_is_left_out_is_a_limit_of_the_size_that_is_expected() -> None:
    found = limits(CASE, within=0.1)["effects left out"]
    assert 1e-3 * (1.0 - 1e-9) <= found.size <= 3e-3 * (1.0 + 1e-9)
    assert found.half.startswith('keep = ["')
    assert found.costs > 1.0


def test_the_grid_that_halves_the_error_has_half_of_it_at_most() -> None:
    front, found = load_front(), limits(CASE)["grid"]
    assert found.size == front.expected_error(CASE)
    n_x = int(found.half.split(",")[0].removeprefix("n_x = "))
    assert n_x > CASE.slab.n_x
    assert found.costs > 0.0


def test_of_a_grid_that_no_front_has_nothing_is_known() -> None:
    found = limits(replace(CASE, slab=Slab(65, poisson=0.123)))["grid"]
    assert math.isnan(found.size)
    assert (found.half, math.isnan(found.costs)) == ("", True)


@pytest.mark.parametrize("events", [30, 300, 3000, 30_000])
def test_the_length_that_is_said_to_halve_what_is_left_open_does(events: int) -> None:
    """To the two digits that are said; of one that takes more than a hundred times as long, nothing is."""
    case = replace(CASE, max_events=events)
    found = limits(case)["length of the record"]
    assert 0.0 < found.size < 1.0
    said = float(found.half.removeprefix("spacings = "))
    assert said > expected_displacement(case) / case.slab.spacing
    longer = limits(replace(case, max_events=None, max_spacings=1.05 * said))["length of the record"]
    assert longer.size <= 0.55 * found.size
    assert found.costs > 1.0


def test_a_longer_record_leaves_less_open() -> None:
    cases = [replace(CASE, max_events=None, max_spacings=spacings) for spacings in (0.1, 0.3, 2.0, 4.0, 8.0)]
    found = [limits(case)["length of the record"].size for case in cases]
    assert found == sorted(found, reverse=True)
    assert found[-1] > 0.0
