"""A check finds all problems of all files, and says in a line what those that are fine would compute."""

import pytest

from nanoslip.study.shipped import campaigns
from tests.conftest import PARTLY_REFUSED, SMALL


def test_a_campaign_that_is_fine_is_one_line(main, campaign):
    code, said, errors = main("check", campaign)
    assert (code, said, errors) == (0, f"{campaign}: fine: 4 cases, 2 drives, 13 tasks\n", "")
    assert [path.name for path in campaign.parent.iterdir()] == [campaign.name]  # nothing is computed or written


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ('stages = ["contact"]\naxes.half_width = [0.2, 0.3]\n', "half_width changes nothing here: only a flat_punch"),
        ('constants.pin = "flat_punch"\naxes.radius = [50, 100]\n', "radius changes nothing here: only a parabola"),
        ("heterogeneity.seed = 7\nlimits.events = 9\n", "seed changes nothing here: without a spread"),
    ],
)
@pytest.mark.parametrize("command", ["check", "plan", "run"])
def test_an_axis_or_a_constant_that_changes_nothing_is_said_with_the_reason(main, campaign, command, given, reason):
    """Else equal numbers over it pass for an answer, as those of a parabola where `pin` was forgotten."""
    campaign.write_text(f'title = "x"\n{given}[numerics]\nn_x = 17\n')
    into = () if command == "check" else ("--out", campaign.parent)
    code, said, errors = main(command, campaign, *into)
    assert code == 0
    assert reason in said + errors


def test_what_matters_to_some_cases_and_limits_of_contacts_are_not_said_to_change_nothing(main, campaign):
    campaign.write_text(
        'title = "x"\nstages = ["contact"]\n[axes]\npin = ["parabola", "flat_punch"]\nradius = [50, 100]\n'
        "[numerics]\nn_x = 17\n[limits]\nevents = 9\n"
    )
    assert "changes nothing" not in main("check", campaign)[1]


def test_all_problems_of_all_files_are_shown_and_the_others_are_fine(main, campaign):
    wrong = campaign.with_name("wrong.toml")
    wrong.write_text(SMALL.replace("n_x = 17", "n_y = 17").replace("[50.0, 100.0]", "[-50.0]"))
    again = campaign.with_name("again.toml")
    again.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 50]"))
    missing = campaign.with_name("missing.toml")
    code, said, errors = main("check", wrong, campaign, again, missing)
    assert (code, said) == (2, f"{campaign}: fine: 4 cases, 2 drives, 13 tasks\n")
    lines = errors.splitlines()
    assert lines[0].startswith(f"Error: {wrong}: axes.radius[0] = -50.0: needs ") or "n_y" in lines[0]
    assert sorted(sum(str(path) in line for line in lines) for path in (wrong, again, missing)) == [1, 2, 2]
    assert any("did you mean n_x?" in line for line in lines)
    assert any("cases 1 and 2 are the same" in line for line in lines)


def test_refused_cases_are_results_that_are_counted(main, campaign):
    campaign.write_text(
        PARTLY_REFUSED + "[drive_axes]\nintegrator = ['rk4']\nduration = [1e-3, 0.2]\ntime_step = [1e-4, 0.1]\n"
    )
    code, said, _ = main("check", campaign)
    assert code == 0
    assert "16 cases (4 of them refused, nanoslip plan says why)" in said
    assert "8 drives (2 of them refused, nanoslip plan says why)" in said


def test_every_campaign_that_comes_with_nanoslip_is_fine(main):
    quick = [
        name for name in campaigns() if not name.startswith(("maps/", "figures/"))
    ]  # others have thousands of cases
    code, said, _ = main("check", *quick)
    assert code == 0
    assert said.count(": fine: ") == len(quick)


AT_ONCE = {
    "an accuracy, and a grid beside it": (
        "accuracy = 2\n[numerics]\nn_x = 33\n",
        ("accuracy = 2: ", "numerics.n_x: needs to be left out beside accuracy"),
    ),
    "members, and a variable whose stage is missing": (
        '[ensemble]\nmembers = 4\n[target]\nwithin = 0.02\nof = ["static_friction"]\n',
        ("ensemble.members = 4: needs to be left out", 'needs stage "dynamics"'),
    ),
    "a duration, and another one": (
        '[[drives]]\nname = "a"\nduration = 0\nduration_periods = 10\n',
        (
            "drives[0].duration = 0: needs 1e-30",
            "drives[0].duration_periods = 10: needs to be left out beside duration = 0",
        ),
    ),
    "settings of an integrator": (
        '[[drives]]\nname = "a"\nintegrator = "foo"\ntime_step = -1\nsurface_compliance = 3\n',
        ('drives[0].integrator = "foo": ', "drives[0].time_step = -1: ", "drives[0].surface_compliance = 3: "),
    ),
}


@pytest.mark.parametrize(("content", "said"), AT_ONCE.values(), ids=AT_ONCE)
def test_no_mistake_hides_another(main, campaign, content, said):
    """Each of them has a line, and there are no more lines."""
    campaign.write_text(f'title = "x"\n{content}')
    code, _, errors = main("check", campaign)
    lines = errors.removeprefix("Error: ").splitlines()
    assert [sum(f"{campaign}: {each}" in line or each in line for line in lines) for each in said] == [1] * len(said)
    assert (code, len(lines)) == (2, len(said))
