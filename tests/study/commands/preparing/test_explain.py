"""One case is explained before it is computed: its groups, its effects, what limits its accuracy, what more would cost."""

import pytest

from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import GROUPS_OF_DRIVES
from tests.conftest import SMALL
from tests.study.plan.influence.made_up import CAMPAIGN, SLIGHT, text

SELECTED = ("intrinsic_friction=0.5", "radius=50")
WITHIN = '[effects]\nwithin = 0.01\ninfluences = "mine.json"\n'


@pytest.fixture
def tolerant(campaign):
    """The small campaign, with a tolerance beyond which nothing matters."""
    campaign.with_name("mine.json").write_text(text(SLIGHT))
    campaign.write_text(CAMPAIGN + WITHIN)
    return campaign


def rows(said: str) -> dict[str, list[str]]:
    lines = ([cell.strip() for cell in line.split("  ") if cell.strip()] for line in said.splitlines())
    return {cells[0]: cells[1:] for cells in lines if cells}


def test_groups_effects_and_limits_of_a_case_are_said(main, tolerant):
    code, said, errors = main("explain", tolerant, *SELECTED)
    assert (code, errors) == (0, "")
    assert said.startswith("case intrinsic_friction = 0.5, radius = 50.0")
    found = rows(said)
    assert found["a/L_x"] == ["0.15", "half-width over slab width"]  # √(2·1e-3·50·(2/3)/π)
    for group in GROUPS_OF_DRIVES:
        assert f"{group.name} of slow" in said
        assert f"{group.name} of fast" in said
    assert "left out, as its changes stay within 0.01 of plateau_mean, kinetic_friction" in said
    assert found["finite_slab"][0] == "left out"
    assert found["surface_compliance of slow"][1] == "0"  # of a plateau, which no drive changes
    assert "estimated time: " in said
    assert {"grid", "length of the record", "effects left out of slow"} <= set(found)
    assert "what limits it most: " in said


def test_effects_that_a_case_does_not_have_are_not_named(main, tolerant):
    _, said, _ = main("explain", tolerant, *SELECTED)
    named = {name for name in OMISSIONS if f"\n{name}" in said}
    assert named == set(OMISSIONS) - {"spread", "roughness"}
    assert "\nspread " not in said
    assert "h_rms" not in said


def test_without_a_tolerance_the_case_is_explained_as_it_is_computed(main, campaign):
    code, said, _ = main("explain", campaign, *SELECTED)
    assert code == 0
    assert "left out if the campaign had [effects] within = 0.01" in said
    assert "effects left out" not in said
    assert {"grid", "length of the record"} <= set(rows(said))


def test_an_ensemble_that_is_to_know_static_friction_is_explained_by_that(main, campaign):
    """Its first member, the case itself; what limits that is another start, not only the grid."""
    campaign.write_text(SMALL + '[ensemble]\nuncertainty = 0.01\nobservable = "static_friction"\n')
    code, said, _ = main("explain", campaign, *SELECTED)
    assert code == 0
    assert "within = 0.01 (0.01 of static_friction)" in said
    assert "start of the pin" in rows(said)


def test_two_times_are_compared_only_where_something_is_left_out(main, tolerant):
    assert " without what is left out" in main("explain", tolerant, *SELECTED)[1]
    kept = ", ".join(f'"{name}"' for name in (*OMISSIONS, WHOLE_LENGTH))
    tolerant.write_text(f"{CAMPAIGN}{WITHIN}keep = [{kept}]\n")
    code, said, _ = main("explain", tolerant, *SELECTED)
    assert (code, "estimated time: " in said, " without what is left out" in said) == (0, True, False)


def test_the_lengths_of_record_and_drives_stand_with_the_effects(main, tolerant):
    campaign = CAMPAIGN.replace("events = 60", "spacings = 16.0")
    tolerant.write_text(campaign + WITHIN)
    found = rows(main("explain", tolerant, *SELECTED)[1])
    of_lengths = {name: cells for name, cells in found.items() if name.startswith(WHOLE_LENGTH)}
    assert set(of_lengths) == {f"{WHOLE_LENGTH} of {part}" for part in ("the record", "slow", "fast")}
    assert any(cells[0] == "shorter" for cells in of_lengths.values())
    tolerant.write_text(f'{campaign}{WITHIN}keep = ["{WHOLE_LENGTH}"]\n')
    kept = rows(main("explain", tolerant, *SELECTED)[1])
    assert {kept[name][0] for name in of_lengths} == {"on"}


def test_contacts_alone_have_no_record_to_be_limited_by(main, campaign):
    campaign.write_text(SMALL.split("[[drives]]")[0].replace(', "slip", "dynamics"', ""))
    code, said, _ = main("explain", campaign, *SELECTED)
    assert code == 0
    assert "length of the record" not in said
    assert "contact_half_width" in said


@pytest.mark.parametrize("pin", ['scheme = "chain"', 'scheme = "biquadratic"', 'initial_contact = "gradual"'])
def test_a_case_unlike_the_measured_ones_says_so(main, campaign, pin):
    campaign.write_text(SMALL.replace("n_x = 17", f"n_x = 17\n{pin}"))
    code, said, _ = main("explain", campaign, *SELECTED)
    assert code == 0
    assert f"influence not known with {pin.replace(chr(34), '')}" in said


@pytest.mark.parametrize("constant", ["intrinsic_friction = inf", "intrinsic_friction = 0.0", 'pin = "flat_punch"'])
def test_extreme_cases_are_explained_too(main, campaign, constant):
    campaign.write_text(f'title = "x"\n[constants]\n{constant}\n[numerics]\nn_x = 17\n')
    code, said, _ = main("explain", campaign)
    assert (code, "what limits it most" in said or "grid" in said) == (0, True)


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
def test_a_selection_of_none_or_several_is_refused_with_advice(main, tolerant, selection, advice):
    code, said, errors = main("explain", tolerant, *selection)
    assert (code, said) == (2, "")
    assert advice in errors


def test_a_case_that_physics_refuses_says_why(main, campaign):
    refused = SMALL.replace("radius = [50.0, 100.0]", "coarsest_row = [5, 17]\nn_x = [9, 17]").replace("n_x = 17\n", "")
    campaign.write_text(refused)
    code, _, errors = main("explain", campaign, "n_x=9", "coarsest_row=17", "intrinsic_friction=0.5")
    assert code == 2
    assert "coarsest_row = 17" in errors


def test_a_mistake_in_the_campaign_is_refused_as_by_check(main, tolerant):
    tolerant.write_text(SMALL + WITHIN + 'keep = ["slab"]\n')
    told = [main(command, tolerant)[2] for command in ("explain", "check", "plan")]
    assert 'effects.keep = "slab": needs one of finite_slab' in told[0]
    assert told[0] == told[1] == told[2]


def test_what_explain_says_is_what_a_plan_does(main, tolerant):
    _, explained, _ = main("explain", tolerant, *SELECTED)
    _, planned, _ = main("plan", tolerant, "--effects")
    for name, cells in rows(explained).items():
        if name in OMISSIONS and cells[0] == "left out":
            assert rows(planned)[name][0] != "0 of 4"
