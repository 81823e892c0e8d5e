"""What a page says in words: every ending is counted, failures first; nothing that is unknown gets a number."""

import numpy as np
import xarray as xr

from nanoslip.study.report import page as overview


def ended(
    words: list[str], messages: list[str], drives: list[str] | None = None, of: list[str] | None = None
) -> xr.Dataset:
    def texts(values: list[str]) -> tuple[str, np.ndarray]:
        return "case", np.array(values, dtype=object)

    variables = {"outcome": texts(words), "message": texts(messages)}
    if drives is not None and of is not None:
        variables |= {"drive_outcome": texts(drives), "drive_message": texts(of)}
    return xr.Dataset(variables)


def test_every_case_is_counted_and_failures_come_first() -> None:
    found = overview.endings(ended(["completed"] * 3 + ["invalid"], ["", "", "", "needs 3 to 6 rows"]))
    assert [(each.words, each.failed) for each in found] == [("1 case: invalid", True), ("3 cases: completed", False)]
    assert [each.text for each in found[0].advice] == ["needs 3 to 6 rows"]


def test_messages_that_differ_in_numbers_alone_are_said_once() -> None:
    messages = [f"still rises by {number}.5%; raise limits.events" for number in range(6)] + ["another"]
    (found,) = overview.endings(ended(["no_plateau"] * 7, messages))
    assert found.words == "7 cases: no plateau"
    assert [(each.text, each.alike) for each in found.advice] == [(messages[0], 5), ("another", 0)]


def test_what_a_drive_inherits_from_its_case_is_said_of_the_case_alone() -> None:
    case, drive = "8 rows: needs 3 to 6", "the pin never slipped: soften the spring"
    data = ended(["invalid", "completed"], [case, ""], ["invalid", "no_slip"], [f"the record: {case}", drive])
    said = {each.words: [text.text for text in each.advice] for each in overview.endings(data)}
    assert said == {
        "1 case: invalid": [case],
        "1 drive: invalid": [],
        "1 drive: no slip": [drive],
        "1 case: completed": [],
    }


def test_more_messages_than_are_shown_are_counted() -> None:
    (found,) = overview.endings(ended(["odd"] * 9, list("abcdefghi")))
    assert len(found.advice) + found.more == 9


def test_accuracy_names_what_is_not_known() -> None:
    data = xr.Dataset(
        {
            "discretization_error": ("case", [0.001, 0.02, np.nan]),
            "plateau_mean": ("case", [0.5, 0.25, np.nan]),
            "plateau_mean_uncertainty": ("case", [0.005, 0.0025, np.nan]),
        }
    )
    grid, plateau = overview.accuracy(data)
    assert grid.endswith(": 0.1 % to 2 %; not measured of 1 of 3 cases.")
    assert plateau == "F/W on the plateau: ± 1 %; not known of 1 of 3 cases."


def test_scales_are_said_in_si_and_left_out_where_a_dataset_does_not_say() -> None:
    data = xr.Dataset({"mean_step": ("case", [1e-6, 2e-6])}, {"normal_load": 1e-3})
    assert list(overview.scales(data)) == []
    scales = {"slab_width": 1e-3, "slab_depth": 1e-2, "shear_modulus": 1e10}
    assert list(overview.scales(data.assign_attrs(scales))) == [
        "Slab width L_x = 1 mm, depth L_y = 10 mm, shear modulus G = 10 GPa",
        "Normal load W: 100 N",
        "Mean step per event: 1 nm to 2 nm",
    ]


def test_records_that_are_not_kept_are_named() -> None:
    data = xr.Dataset({"plateau_mean": ("case", [0.5])})
    assert list(overview.left_out(data)) == [
        "Friction records are not kept ([outputs] of the campaign): there are no figures of single cases."
    ]
    kept = data.assign(record_id=("case", ["r"]))
    assert list(overview.left_out(kept)) == [
        "Distributions of event sizes are not computed: [outputs] statistics of the campaign."
    ]
    assert list(overview.left_out(kept.assign(slips_exponent=("case", [1.5])))) == []


def test_what_all_pins_do_alike_needs_no_count() -> None:
    def of(*words: str) -> str:
        return overview.regimes(xr.Dataset({"regime": ("case", np.array(words, dtype=object))}))

    assert of("slides", "stick_slip", "slides", "") == "2 slides, 1 stick-slip"
    assert of("slides", "slides", "") == overview.regimes(xr.Dataset()) == ""
