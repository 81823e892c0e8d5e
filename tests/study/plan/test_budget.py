"""A budget buys what fits into it: more time buys more accuracy, and a time that is too short is refused with what would do."""

import pytest

from study.manifest.problems import ManifestError
from study.manifest.reader import parse_manifest
from study.plan.budget import seconds_on
from study.plan.plan import Plan, make_plan
from tests.conftest import ROOT

CAMPAIGN = 'title = "x"\n[axes]\nradius = [50, 100]\n[numerics]\nn_x = 33\n'


def planned(time: str, more: str = "") -> Plan:
    return make_plan(parse_manifest(ROOT / "mine.toml", f'{CAMPAIGN}{more}[budget]\ntime = "{time}"\n', {}))


def uncertainty(plan: Plan) -> float:
    return float(str(plan.manifest.limits["target_uncertainty"]))


@pytest.mark.parametrize("seconds", [0.03, 0.1])
def test_what_is_bought_fits_into_the_time(seconds: float) -> None:
    assert seconds_on(planned(f"{seconds} s").tasks, 1) <= seconds


def test_more_time_buys_a_smaller_uncertainty() -> None:
    assert uncertainty(planned("0.1 s")) < uncertainty(planned("0.03 s"))


@pytest.mark.parametrize(("ensemble", "of_whom"), [("", ""), ("[ensemble]\nmembers = 8\n", " with all 8 members")])
def test_a_time_in_which_nothing_fits_is_refused_with_the_least_that_would_and_with_whom_that_counts(
    ensemble: str, of_whom: str
) -> None:
    with pytest.raises(ManifestError, match=rf"needs about \S+ s or more, for uncertainty = 0.1 of plateaus{of_whom}$"):
        planned("0.001 s", ensemble)


@pytest.mark.parametrize("observable", ["static_friction", "kinetic_friction"])
def test_what_a_budget_does_not_buy_is_refused_by_name(observable: str) -> None:
    """Longer records know μ_s no better, and μ_k has the length of its drive."""
    asked = f'[ensemble]\nmembers = 8\nuncertainty = 0.01\nobservable = "{observable}"\n[[drives]]\nname = "a"\n'
    with pytest.raises(
        ManifestError, match=f'ensemble.observable = "{observable}": needs "plateau_mean" beside budget'
    ):
        planned("1 h", asked)


def test_contacts_whose_error_was_not_measured_are_refused_by_what_is_not_known_of_them() -> None:
    text = 'title = "x"\nstages = ["contact"]\n[axes]\npoisson = [0.0, 0.49]\n[budget]\ntime = "20 s"\n'
    with pytest.raises(ManifestError, match=r'budget.time = "20 s": needs a slab and a contact .* it lacks the case'):
        make_plan(parse_manifest(ROOT / "mine.toml", text, {}))


def test_a_campaign_of_refused_cases_alone_spends_nothing() -> None:
    refused = "[slip]\nresidual_shear = 1\n[effects]\npin_translation = false\n"
    text = f'title = "x"\nstages = ["contact"]\n{refused}[budget]\ntime = "20 s"\n'
    plan = make_plan(parse_manifest(ROOT / "mine.toml", text, {}))
    assert not plan.tasks
    assert all(case.case is None for case in plan.cases)


@pytest.mark.parametrize("time", ["1e-300 s", "1e300 d", "0 s"])
def test_a_time_out_of_range_is_refused_with_the_range(time: str) -> None:
    with pytest.raises(ManifestError, match="above 0, with at most nine digits before and nine after the point"):
        parse_manifest(ROOT / "mine.toml", f'{CAMPAIGN}[budget]\ntime = "{time}"\n', {})
