"""A budget buys what fits into it: more time buys more accuracy, and a time that is too short is refused with what would do."""

import pytest

from solver.sliding.validity import UNCERTAIN, flags_in
from study.manifest.problems import ManifestError
from study.manifest.reader import parse_manifest
from study.plan.budget import seconds_on
from study.plan.outlook import outlook_of
from study.plan.plan import Plan, make_plan
from tests.conftest import ROOT

CAMPAIGN = 'title = "x"\n[axes]\nradius = [50, 100]\n[numerics]\nn_x = 33\n'


def planned(time: str, more: str = "", campaign: str = CAMPAIGN) -> Plan:
    return make_plan(parse_manifest(ROOT / "mine.toml", f'{campaign}{more}[budget]\ntime = "{time}"\n', {}))


def uncertainty(plan: Plan) -> float:
    return float(str(plan.manifest.limits["target_uncertainty"]))


@pytest.mark.parametrize("seconds", [0.03, 0.1])
def test_what_is_bought_fits_into_the_time(seconds: float) -> None:
    assert seconds_on(planned(f"{seconds} s").tasks, 1) <= seconds


def test_more_time_buys_a_smaller_uncertainty() -> None:
    assert uncertainty(planned("0.1 s")) < uncertainty(planned("0.03 s"))


@pytest.mark.parametrize("seconds", [0.1, 60.0])
def test_a_case_that_cannot_know_more_leaves_the_others_what_the_budget_buys(seconds: float) -> None:
    """A record of one spacing ends at its limit, and is flagged; it takes next to nothing of the time."""
    both, long, short = (
        planned(f"{seconds} s", campaign=CAMPAIGN.replace("[50, 100]", f"[100]\nspacings = {each}"))
        for each in ([1, 1000], [1000], [1])
    )
    assert uncertainty(both) == uncertainty(long) < uncertainty(short)
    assert seconds_on(both.tasks, 1) <= seconds
    flags = [UNCERTAIN in flags_in(mask) for mask in outlook_of(both).masks]
    assert flags == [True, False]


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
