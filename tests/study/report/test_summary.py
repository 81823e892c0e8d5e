"""What is said of a dataset in a few lines: how many drives ended how, in which regime, and what failed."""

from pathlib import Path

import numpy as np
import xarray as xr

from nanoslip.study import api
from nanoslip.study.report.console import table_lines
from nanoslip.study.report.page import regimes
from nanoslip.study.report.summary import (
    FEW,
    drive_summary,
    failure_summary,
    scalar_table,
    short_summary,
    words,
)
from tests.study.figures.cases import product

CONTACTS = {
    "title": "Contacts",
    "stages": ["contact"],
    "axes": {"normal_load": [1e-4, 1e-3]},
    "constants": {"radius": 50.0},
    "numerics": {"n_x": 33},
}


def over_axes() -> xr.Dataset:
    """One case, two drives that vary in stiffness and three in velocity."""
    dims = ("intrinsic_friction", "spring_stiffness", "stage_velocity")
    regimes = np.array([[["sticks", "slides", "slides"], ["slides", "", "stick_slip"]]], dtype=object)
    endings = np.where(regimes == "", "invalid", "completed").astype(object)
    return xr.Dataset(
        {
            "outcome": ("intrinsic_friction", np.array(["completed"], dtype=object)),
            "message": ("intrinsic_friction", np.array([""], dtype=object)),
            "static_friction": (dims, np.full(regimes.shape, 0.3)),
            "regime": (dims, regimes),
            "drive_outcome": (dims, endings),
            "drive_message": (dims, np.where(regimes == "", "needs another value", "").astype(object)),
        },
        {"intrinsic_friction": [0.5], "spring_stiffness": [1e4, 1e5], "stage_velocity": [1e-3, 2e-3, 3e-3]},
    )


def test_the_endings_and_regimes_of_many_drives_are_counted() -> None:
    many = xr.concat([over_axes()] * 10, "pin_mass", data_vars="all")
    assert drive_summary(many) == [
        "drive_outcome of 60 drives: 50 completed, 10 invalid",
        "regime of 60 drives: 30 slides, 10 sticks, 10 stick_slip",
    ]


def test_a_drive_whose_members_differ_counts_as_most_of_them_did() -> None:
    many = xr.concat([over_axes()] * 10, "pin_mass", data_vars="all")
    mixed = many.assign(regime=many.regime.where(many.regime != "slides", "7 slides; 1 stick_slip"))
    assert drive_summary(mixed) == drive_summary(many)
    assert regimes(mixed) == regimes(many) == "30 slides, 10 sticks, 10 stick-slip"


def test_a_few_drives_need_no_count() -> None:
    assert over_axes().regime.size < FEW
    assert drive_summary(over_axes()) == []


def failing(endings: list[str], messages: list[str], drives: list[list[str]] | None = None) -> xr.Dataset:
    """Cases over load that ended so; with drives, whose messages are given, they ended as no_slip or as their case."""
    load = ("normal_load",)
    variables = {
        "outcome": (load, np.array(endings, dtype=object)),
        "message": (load, np.array(messages, dtype=object)),
    }
    if drives:
        texts = np.array(drives, dtype=object)
        words = np.where(texts == "", "completed", "no_slip").astype(object)
        both = ("normal_load", "drive")
        variables |= {"drive_outcome": (both, words), "drive_message": (both, texts)}
    found = xr.Dataset(variables, {"normal_load": 10.0 ** -np.arange(1, len(endings) + 1)})
    return found.assign_coords(drive=["a", "b"]) if drives else found


def test_failures_that_say_the_same_are_one_line_with_their_number_and_the_first_of_them() -> None:
    found = failing(
        ["cascade_limit", "completed", "cascade_limit", "steep_pin"], ["raise it", "", "raise it", "lower it"]
    )
    assert failure_summary(found) == [
        "cascade_limit: 2 of 4 cases, first W/(G·L_x·L_y) = 0.1: raise it",
        "steep_pin: 1 of 4 cases, first W/(G·L_x·L_y) = 1e-4: lower it",
    ]


def test_failures_that_differ_in_numbers_are_one_line_that_says_so() -> None:
    found = failing(["no_plateau"] * 3, ["rises by 3.5%: more", "rises by 1e-3%: more", "falls by 3.5%: more"])
    assert failure_summary(found) == [
        "no_plateau: 2 of 3 cases, first W/(G·L_x·L_y) = 0.1: rises by 3.5%: more; the others differ in numbers",
        "no_plateau: 1 of 3 cases, first W/(G·L_x·L_y) = 0.001: falls by 3.5%: more",
    ]


def test_what_a_drive_inherits_from_its_case_is_said_once() -> None:
    found = failing(
        ["no_slip", "completed"],
        ["too flat", ""],
        [["too flat", "none to repeat: too flat"], ["", "soften the spring"]],
    )
    assert failure_summary(found) == [
        "no_slip: 1 of 2 cases, first W/(G·L_x·L_y) = 0.1: too flat",
        "no_slip: 1 of 4 drives, first W/(G·L_x·L_y) = 0.01, drive = b: soften the spring",
    ]


def test_what_is_pending_or_completed_is_no_failure() -> None:
    assert failure_summary(failing(["completed", "pending"], ["", ""])) == []


def test_every_drive_of_the_axes_is_a_row_that_names_its_place() -> None:
    table = scalar_table(over_axes())
    assert table.header == ("k (N/m)", "V_o (m/s)", "μ_s", "regime", "outcome")
    assert table.rows[1] == ("1e4", "0.002", "0.3", "slides", "completed")
    assert table.rows[4] == ("1e5", "0.002", "0.3", "–", "invalid: needs another value")
    assert scalar_table(over_axes(), why=False).rows[4][-1] == "invalid"


def test_numbers_are_still_there_where_members_differ_in_their_regime_and_a_terminal_is_narrow() -> None:
    """What a campaign is asked is a number; the words of a regime may be left out."""
    mixed = over_axes().isel(spring_stiffness=[0], stage_velocity=[1, 2])
    mixed["regime"][:] = "13 stick_slip; 2 sticks; 1 slides"
    mixed["drive_outcome"][:] = "14 no_plateau; 2 no_slip"
    *_, left_out = table_lines(scalar_table(mixed), 45)
    assert left_out.text == "not shown, for lack of width: regime"


def test_contacts_alone_show_what_contacts_are(tmp_path: Path) -> None:
    """Each number in its column; mean pressure times width is the load."""
    found = api.run({**CONTACTS, "ensemble": {"members": 1}}, tmp_path)
    table = scalar_table(found)
    assert table.header == (
        "W/(G·L_x·L_y)",
        "a/L_x",
        "approach/L_x",
        "mean p·L_x·L_y/W",
        "max p·L_x·L_y/W",
        "members",
        "outcome",
    )
    numbers = np.array([[float(cell) for cell in (each.split(" ±")[0] for each in row[:-2])] for row in table.rows])
    names = ("normal_load", "contact_half_width", "approach", "mean_pressure", "maximum_pressure")
    np.testing.assert_allclose(numbers, np.stack([found[name].values.ravel() for name in names], 1), rtol=5e-3)
    np.testing.assert_allclose(found.mean_pressure * 2.0 * found.contact_half_width, 1.0, rtol=1e-12)  # inside the slab
    assert (found.maximum_pressure > found.mean_pressure).all()


def test_rows_that_failed_are_known_and_unfinished_ones_are_no_failures() -> None:
    found = over_axes()
    assert scalar_table(found).failed == {4}
    found["drive_outcome"][0, 0, 0] = "pending"
    assert scalar_table(found).failed == {4}


def test_a_list_of_cases_is_labelled_by_what_its_author_lists_and_not_by_what_follows() -> None:
    found = api.run(
        {
            "title": "List",
            "stages": ["contact"],
            "design": "zip",
            "axes": {"n_x": [33, 65], "radius": [50.0, 20.0]},
            "constants": {"normal_load": 1e-4},
        }
    )
    assert len(set(found.bottom_row.values.tolist())) == 2
    assert scalar_table(found).header[:3] == ("R/L_x", "n_x", "a/L_x")


def ensembles(errors: list[float], asked: str = "[target]\nwithin = 0.02") -> xr.Dataset:
    """Cases over the load, whose plateaus are -0.5 and known so well."""
    load = ("normal_load",)
    return xr.Dataset(
        {
            "plateau_mean": (load, np.full(len(errors), -0.5)),
            "plateau_mean_uncertainty": (load, 0.5 * np.array(errors)),
        },
        {"normal_load": 1e-4 * np.arange(1, len(errors) + 1)},
        {"manifest": asked},
    )


def test_numbers_less_known_than_was_asked_for_are_counted_with_the_first_and_the_worst() -> None:
    assert short_summary(ensembles([0.009, 0.011, 0.034])) == [
        "plateau_mean is not known within 0.02: 2 of 3 cases, first W/(G·L_x·L_y) = 2e-4; the worst to 6.8%; raise target.most"
    ]


def test_complete_cases_without_a_mean_asked_for_are_counted_too() -> None:
    """A drive that slides has no stick-slip period, however many members there are; an unfinished one has none yet."""
    found = ensembles([0.01, np.nan, np.nan])
    found["plateau_mean"][1:] = np.nan
    found["outcome"] = "normal_load", ["completed", "completed", "pending"]
    assert short_summary(found) == [
        "plateau_mean is not known within 0.02: 1 of 3 cases, first W/(G·L_x·L_y) = 2e-4; too few members have a value"
    ]


def test_numbers_that_are_known_unfinished_or_asked_for_by_nobody_are_not_short_of_anything() -> None:
    assert short_summary(ensembles([0.009, 0.01])) == []
    assert short_summary(ensembles([np.nan])) == []
    assert short_summary(ensembles([0.02], asked="[ensemble]\nmembers = 8")) == []
    assert short_summary(ensembles([0.02], asked='[target]\nwithin = 0.02\nof = ["static_friction"]')) == []
    assert short_summary(xr.Dataset()) == []


def test_what_has_ended_is_in_a_table_before_what_has_not_and_the_rest_is_counted() -> None:
    endings = ["pending"] * 7 + ["completed", "pending", "invalid"]
    table = scalar_table(failing(endings, [""] * 10), most=4)
    assert [row[-1] for row in table.rows] == ["pending", "pending", "completed", "invalid", "6 more"]
    assert table.failed == {3}
    assert len(scalar_table(failing(endings, [""] * 10), most=10).rows) == 10


def test_what_a_campaign_asks_for_stands_before_other_numbers() -> None:
    data = product(intrinsic_friction=[0.2, 0.4], radius=[50.0, 100.0])
    driven = data.assign({
        name: data["plateau_mean"].copy() for name in ("static_friction", "kinetic_friction", "mean_step")
    } | {"drive_outcome": data["outcome"].copy(), "drive_message": data["message"].copy()})  # fmt: skip
    assert scalar_table(data).header[2:] == ("plateau F/W", "outcome")
    table = scalar_table(driven)
    assert (table.header[2:5], table.asked) == (("μ_s", "μ_k", "plateau F/W"), 2)
    driven.attrs["manifest"] = '[target]\nwithin = 0.02\nof = ["kinetic_friction"]\n'
    table = scalar_table(driven)
    assert (table.header[2:5], table.asked) == (("μ_k", "μ_s", "plateau F/W"), 2)


def test_settings_that_a_case_has_not_are_no_part_of_its_label() -> None:
    assert words({"radius": 50.0, "first_spacing": "", "rows": float("nan")}) == "R/L_x = 50"


def test_the_half_width_of_a_punch_and_that_of_its_contact_have_titles_of_their_own() -> None:
    punches = product(half_width=[0.01, 0.1], intrinsic_friction=[0.2])
    table = scalar_table(punches.assign(contact_half_width=punches["plateau_mean"]))
    assert len(set(table.header)) == len(table.header)
    assert table.header[0] == "a/L_x"
