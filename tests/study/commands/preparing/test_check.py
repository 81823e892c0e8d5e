"""A check finds all problems of all files, and says in a line what those that are fine would compute."""

from study.shipped import campaigns
from tests.conftest import PARTLY_REFUSED, SMALL


def test_a_campaign_that_is_fine_is_one_line(main, campaign):
    code, said, errors = main("check", campaign)
    assert (code, said, errors) == (0, f"{campaign}: fine: 4 cases, 2 drives, 13 tasks\n", "")
    assert [path.name for path in campaign.parent.iterdir()] == [campaign.name]  # nothing is computed or written


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
