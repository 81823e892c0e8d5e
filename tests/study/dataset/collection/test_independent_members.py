"""What each member finds of its own, as the exponent of its events: the ensemble's ± is what members differ by."""

import math

import numpy as np
import pytest
import xarray as xr

from solver.view import with_error
from study.dataset.collection.ensemble import ensemble_variables, observables, over_members
from study.dataset.variables import scalars
from study.figures.sweep.points import points_of
from study.manifest.cases import MEMBER
from study.plan.tasks import KINDS
from study.report.summary import scalar_table

EXPONENT = "slips_exponent"
FOUND = [2.39, math.nan, 3.11, math.nan, 2.45, math.nan, math.nan, 3.08]


def campaign(values: list[float], stated: float) -> xr.Dataset:
    """One case whose members found these exponents, each with the error that its fit states."""
    each = np.ones(len(values))
    columns = {
        "outcome": np.full(len(values), "completed", object),
        "message": np.full(len(values), "", object),
        "record_spacings": 2.0 * each,
        "events": 1000.0 * each,
        EXPONENT: np.array(values),
        f"{EXPONENT}_fit_error": np.where(np.isnan(values), math.nan, stated),
    }
    variables = {name: xr.Variable((MEMBER,), put) for name, put in columns.items()}
    return xr.Dataset(variables | ensemble_variables(variables), {MEMBER: np.arange(len(values))})


def shown(values: list[float], stated: float = 0.08) -> tuple[float, float]:
    """Mean and standard error of an ensemble, as tables and figures have them."""
    found = over_members(campaign(values, stated))
    return found[EXPONENT].item(), found[f"{EXPONENT}_uncertainty"].item()


def test_an_exponents_error_is_the_scatter_of_the_members_that_have_one() -> None:
    mean, error = shown(FOUND)
    values = np.array([2.39, 3.11, 2.45, 3.08])
    student = 3.182446 / 2.0  # of three degrees of freedom, 95 of 100: from a table
    assert mean == pytest.approx(values.mean(), rel=1e-15)
    assert error == pytest.approx(student * values.std(ddof=1) / 2.0, rel=1e-6)


def test_tables_and_figures_show_it_and_no_error_of_a_fit() -> None:
    """Of an exponent of which a member alone states none."""
    dataset = campaign(FOUND, 0.08)
    (row,) = scalar_table(dataset).rows
    mean, error = shown(FOUND)
    assert f"{with_error(mean, error)} (4 of 8)" in row
    assert points_of(over_members(dataset), EXPONENT).errors.tolist() == [error]
    assert f"{EXPONENT}_fit_error" not in over_members(dataset)
    (row,) = scalar_table(dataset.isel({MEMBER: [0]}).squeeze(MEMBER)[["outcome", "message", EXPONENT]]).rows
    assert "2.39" in row


def test_of_one_member_that_has_a_value_no_error_is_known() -> None:
    mean, error = shown([math.nan, 2.36, math.nan])
    assert mean == 2.36
    assert math.isnan(error)


@pytest.mark.parametrize("members", [4, 8, 32])
def test_two_starts_of_a_campaign_agree_within_twice_their_errors(members: int) -> None:
    """Members fit better than they agree, as on records that differ: 2.5 ± 0.3 from start to start, 0.05 stated by each."""
    draw, repetitions = np.random.default_rng(1), 200
    agree = 0
    for _ in range(repetitions):
        (one, here), (other, there) = (shown(draw.normal(2.5, 0.3, members).tolist(), 0.05) for _ in range(2))
        agree += abs(one - other) <= 2.0 * math.hypot(here, there)
    # 95 of 100 or a little more, as Student's t of few is on the safe side for a difference; 3 standard errors of a share of 200
    assert agree / repetitions >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / repetitions)


def test_whatever_states_an_error_of_its_own_makes_an_ensemble() -> None:
    """Else a mean of its members' own errors would stand behind ±, which knows nothing of how they differ."""
    stated = {
        each.name for kind in KINDS for each in scalars(kind).values() if each.uncertainty.endswith("_uncertainty")
    }
    assert EXPONENT not in stated
    assert "stick_slip_period" in stated
    assert stated <= set(observables())
