"""A dataset says of each case and drive what a tolerance left out, and how much that is expected to change."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from study.dataset import file
from study.dataset.collection.collect import collect
from study.dataset.file import INFLUENCES
from study.dataset.made_of import made_of
from study.dataset.variables import influences
from study.manifest.reader import load_manifest
from study.plan.influence.scene import OBSERVABLES, OF_DRIVES
from study.plan.plan import Plan, make_plan
from study.plan.standing.outline import asked
from study.results.store import Store
from tests.conftest import SMALL
from tests.study.dataset.campaigns import compute
from tests.study.plan.influence.made_up import CAMPAIGN, SLIGHT, text

KEPT = 'keep = ["whole_length"]\n'
WITHIN = '[effects]\nwithin = 0.01\ninfluences = "mine.json"\n'


def computed(folder: Path, campaign: str, changes: Mapping[str, float] = SLIGHT) -> tuple[Plan, xr.Dataset]:
    folder.mkdir(exist_ok=True)
    (folder / "mine.json").write_text(text(changes))
    (folder / "mine.toml").write_text(campaign)
    plan, store = make_plan(load_manifest(folder / "mine.toml")), Store(folder)
    compute(plan, store)
    return plan, collect(plan, store)


def of_influence(found: xr.Dataset) -> set[str]:
    return {name for name in found.variables if str(name).endswith(("_influence", "left_out", "length_error_allowed"))}


def test_without_a_tolerance_nothing_is_said_of_it(tmp_path: Path) -> None:
    _, found = computed(tmp_path, CAMPAIGN)
    assert not of_influence(found)
    assert INFLUENCES not in found.attrs


def test_every_case_and_drive_says_what_it_lacks_and_what_that_is_expected_to_change(tmp_path: Path) -> None:
    plan, found = computed(tmp_path, CAMPAIGN + WITHIN)
    assert found.attrs[INFLUENCES] == str(plan.tolerance.influences)  # type: ignore[union-attr]
    assert found.attrs["manifest_influences"] == text(SLIGHT)
    said = []
    for case in plan.cases:
        here = found.sel(intrinsic_friction=case.parameters["intrinsic_friction"], radius=case.parameters["radius"])
        here, decision = here.squeeze(), plan.decisions[case.case_id]
        assert here["left_out"].item() == ", ".join(decision.left_out())
        said.append(here["left_out"].item())
        for name, value in zip(OBSERVABLES, decision.influence(), strict=True):
            if name not in OF_DRIVES and name in found:
                np.testing.assert_equal(here[f"{name}_influence"].item(), value)
        for drive in ("slow", "fast"):
            pulled = here.sel(drive=drive)
            assert pulled["drive_left_out"].item() == ", ".join(decision.left_out(drive))
            for name in OF_DRIVES:
                expected = decision.influence(drive)[OBSERVABLES.index(name)]
                np.testing.assert_equal(pulled[f"{name}_influence"].item(), expected)
    assert any(said)


def test_every_record_and_drive_says_up_to_which_error_by_its_length_it_was_computed(tmp_path: Path) -> None:
    plan, found = computed(tmp_path, CAMPAIGN + WITHIN, dict.fromkeys(SLIGHT, 0.5))
    allowed = set()
    for case in plan.cases:
        here = found.sel(intrinsic_friction=case.parameters["intrinsic_friction"], radius=case.parameters["radius"])
        here, decision = here.squeeze(), plan.decisions[case.case_id]
        errors = [decision.length_error(label) for label in ("", "slow", "fast")]
        allowed.update(errors)
        pulled = [here["drive_length_error_allowed"].sel(drive=label).item() for label in ("slow", "fast")]
        np.testing.assert_equal(
            [here["length_error_allowed"].item(), *pulled], [np.nan if each is None else each for each in errors]
        )
    assert allowed - {None}
    _, kept = computed(tmp_path / "kept", CAMPAIGN + WITHIN + KEPT)
    assert np.isnan(kept["length_error_allowed"]).all()
    assert np.isnan(kept["drive_length_error_allowed"]).all()


@pytest.mark.parametrize("stages", [1, 2, 3])
def test_what_is_expected_to_change_is_in_the_dataset_itself(tmp_path: Path, stages: int) -> None:
    listed = ", ".join(f'"{stage}"' for stage in ("contact", "slip", "dynamics")[:stages])
    campaign = SMALL.replace('["contact", "slip", "dynamics"]', f"[{listed}]")
    _, found = computed(tmp_path, campaign + WITHIN)
    named = {name for name, quantity in influences().items() if quantity.name in found}
    assert named
    assert all(name in found.variables for name in named)
    assert ("plateau_mean" in named, "kinetic_friction" in named) == (stages > 1, stages > 2)
    assert ("drive_left_out" in found) == (stages > 2)


def test_a_refused_case_says_nothing_of_it(tmp_path: Path) -> None:
    refused = SMALL.replace("radius = [50.0, 100.0]", "coarsest_row = [5, 17]\nn_x = [9, 17]").replace("n_x = 17\n", "")
    _, found = computed(tmp_path, refused + WITHIN)
    here = found.sel(n_x=9, coarsest_row=17).isel(intrinsic_friction=0).squeeze()
    assert here["outcome"].item() == "invalid"
    assert here["left_out"].item() == ""
    assert np.isnan(here["contact_half_width_influence"].item())


def test_the_same_results_give_the_same_bytes(tmp_path: Path) -> None:
    kept = []
    for name in ("one", "two"):
        _, found = computed(tmp_path / name, CAMPAIGN + WITHIN)
        file.write(found, tmp_path / f"{name}.nc")
        kept.append((tmp_path / f"{name}.nc").read_bytes())
    assert kept[0] == kept[1]


def test_other_influences_are_another_plan_and_another_dataset(tmp_path: Path) -> None:
    """What is kept of a plan or of a dataset is not taken for that of a campaign with other influences."""
    told = []
    for change in (1e-3, 2e-3):
        (tmp_path / "mine.json").write_text(text(dict.fromkeys(SLIGHT, change)))
        (tmp_path / "mine.toml").write_text(CAMPAIGN + WITHIN)
        plan = make_plan(load_manifest(tmp_path / "mine.toml"))
        told.append((asked(plan.manifest), made_of(plan.manifest, Store(tmp_path))))
    assert len({each[0] for each in told}) == len({each[1] for each in told}) == 2


def test_where_everything_matters_the_numbers_are_those_without_a_tolerance(tmp_path: Path) -> None:
    _, plain = computed(tmp_path / "plain", CAMPAIGN)
    _, tolerant = computed(tmp_path / "tolerant", CAMPAIGN + WITHIN + KEPT, dict.fromkeys(SLIGHT, 0.5))
    assert set(tolerant["left_out"].values.ravel()) == {""}
    xr.testing.assert_identical(tolerant.drop_vars(of_influence(tolerant)).drop_attrs(), plain.drop_attrs())


@pytest.mark.parametrize(
    "axes",
    [
        "aspect_ratio = [1.0, 0.5]\nspread = [0.0, 0.01]\nsupport = ['bonded', 'right_side']\n",
        "aspect_ratio = [0.5]\nspread = [0.02]\nsupport = ['right_side']\n",
    ],
)
@pytest.mark.parametrize("design", ["product", "zip"])
def test_parameters_are_those_that_were_asked_for_whatever_was_left_out(tmp_path: Path, axes: str, design: str) -> None:
    """So that cases are found, and compared, by what the campaign says of them."""
    campaign = f'title = "x"\ndesign = "{design}"\n[axes]\n{axes}[constants]\nradius = 50.0\n[limits]\nevents = 200\n'
    campaign += "[numerics]\nn_x = 65\n"
    (plain, _), (tolerant, _) = (
        (found, plan)
        for plan, found in (
            computed(tmp_path / "plain", campaign),
            computed(tmp_path / "tolerant", campaign + WITHIN.replace("0.01", "0.5")),
        )
    )
    assert "finite_slab" in "".join(map(str, tolerant["left_out"].values.ravel()))
    assert plain.coords.keys() == tolerant.coords.keys()
    for name in plain.coords:
        xr.testing.assert_identical(plain[name].variable, tolerant[name].variable)


def test_uncertainties_hold_what_leaving_out_is_expected_to_change(tmp_path: Path) -> None:
    """They are no smaller than that, and as large a share of a number in whatever unit it is given."""
    _, found = computed(tmp_path, CAMPAIGN + WITHIN)
    for name, error in (("plateau_mean", "plateau_uncertainty"), ("kinetic_friction", "kinetic_friction_uncertainty")):
        change = (found[f"{name}_influence"] * abs(found[name])).values
        known = np.isfinite(change) & np.isfinite(found[error].values)
        assert known.any()
        assert (change[known] > 0.0).all()
        assert (found[error].values[known] >= change[known]).all()
    share = found["plateau_uncertainty"] / found["plateau_mean"]
    xr.testing.assert_allclose(found["plateau_ratio_uncertainty"] / found["plateau_ratio"], share)
