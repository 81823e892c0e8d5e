"""One case is explained before it is computed: what it costs, what its grid leaves open, and what half of that costs."""

import pytest

from tests.conftest import SMALL

SELECTED = ("intrinsic_friction=0.5", "radius=50")


def test_time_and_grid_of_a_case_are_said(main, campaign):
    campaign.write_text("accuracy = 0.05\n" + SMALL.replace("n_x = 17", ""))
    code, said, errors = main("explain", campaign, *SELECTED)
    assert (code, errors) == (0, "")
    assert said.startswith("case intrinsic_friction = 0.5, radius = 50.0")
    assert "estimated time, to a factor of three: " in said
    error = float(said.split("approach and stiffness: ")[1].split(";")[0])
    assert 0.0 < error <= 0.05
    times = float(said.split("half of it costs ")[1].split(" ×")[0])
    assert times > 1.0


def test_a_grid_that_was_not_measured_is_named_so(main, campaign):
    campaign.write_text(SMALL.replace("[numerics]", '[constants]\npin = "flat_punch"\n[numerics]'))
    code, said, _ = main("explain", campaign, *SELECTED)
    assert code == 0
    assert "error of the grid: not measured" in said


@pytest.mark.parametrize("constant", ["intrinsic_friction = inf", "intrinsic_friction = 0.0", 'pin = "flat_punch"'])
def test_extreme_cases_are_explained_too(main, campaign, constant):
    campaign.write_text(f'title = "x"\n[constants]\n{constant}\n[numerics]\nn_x = 17\n')
    code, said, _ = main("explain", campaign)
    assert (code, "error of the grid" in said) == (0, True)


@pytest.mark.parametrize(
    ("selection", "advice"),
    [
        ((), "no selection: 4 cases are like that; say intrinsic_friction = 0.25 or 0.5, radius = 50.0 or 100.0"),
        (("radius=50",), "radius=50: 2 cases are like that; say intrinsic_friction = 0.25 or 0.5"),
        (("radius=60",), "radius=60: no such case; there are 50.0, 100.0"),
        (("colour=red",), "colour=red: these cases are told apart by "),
        (("radius",), "radius: needs key=value"),
    ],
)
def test_a_selection_of_none_or_several_is_refused_with_advice(main, campaign, selection, advice):
    code, said, errors = main("explain", campaign, *selection)
    assert (code, said) == (2, "")
    assert advice in errors


def test_a_case_that_physics_refuses_says_why(main, campaign):
    refused = SMALL.replace("radius = [50.0, 100.0]", "coarsest_row = [5, 17]\nn_x = [9, 17]").replace("n_x = 17\n", "")
    campaign.write_text(refused)
    code, _, errors = main("explain", campaign, "n_x=9", "coarsest_row=17", "intrinsic_friction=0.5")
    assert code == 2
    assert "coarsest_row = 17" in errors


def test_effects_of_a_case_are_those_of_a_campaign_of_it_alone(main, campaign, tmp_path):
    """Changes alike; seconds are measured and differ."""
    alone = tmp_path / "alone.toml"
    alone.write_text(campaign.read_text().replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]"))
    code, said, _ = main("explain", campaign, *SELECTED, "--effects")
    _, expected, _ = main("effects", alone)
    assert code == 0
    assert changes(said) == changes(expected) != []


def changes(said: str) -> list[list[str]]:
    """Effect, number and change of each row."""
    return [line.split()[:5] for line in said.splitlines() if " ± " in line]
