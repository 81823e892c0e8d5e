"""The report shows what the dataset holds, needs no other file, and copes with datasets that are not complete."""

import base64
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.file import carrying, groups_of
from nanoslip.study.figures.views import SORTS
from nanoslip.study.report import page as report_page
from nanoslip.study.report import summary
from nanoslip.study.results.store import StoreError


def made_up(design: str = "product", outcome: str = "completed", drives: int = 1) -> xr.Dataset:
    """Two cases with two events each, as `nanoslip.study.dataset.collect` lays them out."""
    dims = ("case",) if design == "case" else ("intrinsic_friction", "n_x")
    shape = (2,) if design == "case" else (2, 1)

    def over_cases(values: list[object]) -> tuple[tuple[str, ...], np.ndarray]:
        return dims, np.array(values, dtype=object if isinstance(values[0], str) else None).reshape(shape)

    def over_drives(values: list[object]) -> tuple[tuple[str, ...], np.ndarray]:
        if drives == 1:
            return over_cases(values)
        return (*dims, "drive"), np.stack([over_cases(values)[1]] * drives, axis=-1)

    friction = ("case", [0.25, 0.5]) if design == "case" else ("intrinsic_friction", [0.25, 0.5])
    coordinates = {
        "intrinsic_friction": friction,
        "n_x": ("case", [17, 17]) if design == "case" else ("n_x", [17]),
        "case_id": over_cases(["aaaa", "bbbb"]),
        "drive": ((), "pull") if drives == 1 else ("drive", [f"pull/{number}" for number in range(drives)]),
    }
    if design == "case":
        coordinates["case"] = ("case", [0, 1])
    variables = {
        "plateau_mean": over_cases([0.14321, np.nan]),
        "plateau_mean_uncertainty": over_cases([0.00042, np.nan]),
        "peak_friction": over_cases([0.2, np.nan]),
        "events": over_cases([2.0, np.nan]),
        "initial_friction": over_cases([0.0, np.nan]),
        "outcome": over_cases(["completed", outcome]),
        "message": over_cases(["", "" if outcome == "completed" else "do < this > instead"]),
        "static_friction": over_drives([0.15, np.nan]),
        "kinetic_friction": over_drives([0.14, np.nan]),
        "drive_outcome": over_drives(["completed", outcome]),
        "drive_message": over_drives(["", ""]),
        "record_id": over_cases(["r", ""]),
        "trajectory_id": over_drives(["t", ""]),
        "final_displacement": over_cases([0.4, np.nan]),
        "final_friction": over_cases([0.1, np.nan]),
    }
    groups = {
        "record": xr.Dataset(
            {
                "row_size": ("record", [2]),
                "event_friction_before": ("event", [0.10, 0.12]),
                "event_friction_after": ("event", [0.05, 0.06]),
            },
            {"record": ["r"], "displacement": ("event", [0.1, 0.3])},
        ),
        "trajectory": xr.Dataset(
            {"trajectory_row_size": ("trajectory", [2]), "sample_spring_force": ("sample", [0.0, 0.2])},
            {"trajectory": ["t"], "time": ("sample", [0.0, 0.1])},
        ),
    }
    attributes = {"title": "Made <up>", "manifest": 'title = "Made <up>"', "source_commit": "abc"}
    return carrying(xr.Dataset(variables, coordinates, attributes), groups)


def test_the_table_has_a_row_for_each_case_labelled_by_what_varies():
    table = summary.scalar_table(made_up())
    assert table.header == ("μ_i", "μ_s", "μ_k", "plateau F/W", "peak F/W", "events", "δ_p/L_x", "outcome")
    assert table.rows[0] == ("0.25", "0.15", "0.14", "0.1432 ± 0.0004", "0.2", "2", "0.4", "completed")


def test_a_case_without_numbers_shows_dashes_and_its_advice():
    row = summary.scalar_table(made_up(outcome="invalid")).rows[1]
    assert row == ("0.5", "–", "–", "–", "–", "–", "–", "invalid: do < this > instead")


@pytest.mark.parametrize("design", ["product", "case"])
def test_several_drives_are_rows_of_their_own(design):
    table = summary.scalar_table(made_up(design, drives=2))
    assert table.header[:2] == ("μ_i", "drive")
    assert [row[:2] for row in table.rows[:2]] == [("0.25", "pull/0"), ("0.25", "pull/1")]


def data_of(text: str, name: str) -> str:
    """The file behind a link of the page."""
    found = re.search(rf'download="{name}.csv" href="data:text/csv;base64,([^"]*)"', text)
    assert found, name
    return base64.b64decode(found[1]).decode()


@pytest.fixture(scope="module")
def failing(tmp_path_factory):
    """The page of one completed and one invalid case, alone in its folder."""
    return report_page.write(made_up(outcome="invalid"), tmp_path_factory.mktemp("page"))


def test_the_page_holds_all_of_it_and_needs_no_other_file(failing):
    text = failing.read_text("utf-8")
    assert [path.name for path in failing.parent.iterdir()] == [report_page.FILE]
    assert text.count('<img src="data:image/svg+xml;base64,') == text.count("<img") == 2  # record and drive
    assert (
        "F/W on the plateau over μ<sub>i</sub>: 0.5728 ± 0.0017 at μ<sub>i</sub> = 0.25, the only one of 2 that has it."
        in text
    )
    assert "http" not in text
    assert "0.1432 ± 0.0004" in text
    assert "Made &lt;up&gt;" in text
    assert "Made <up>" not in text
    assert "Lines of many points are thinned" in text
    assert "thinned" not in report_page.page(made_up()[["outcome", "message"]], [])
    assert "Not known: nothing beside the dataset says" in text


def test_failures_come_first_each_with_its_advice(failing):
    text = failing.read_text("utf-8")
    assert text.index('<span class="bad">1 case: invalid') < text.index('<span class="good">1 case: completed')
    assert "<li>do &lt; this &gt; instead</li>" in text
    assert '<tr class="bad"><td>0.5</td>' in text


def test_the_numbers_of_a_figure_are_behind_its_link(failing):
    text = failing.read_text("utf-8")
    record = "displacement,friction_force 0,0 0.1,0.1 0.1,0.05 0.3,0.12 0.3,0.06 0.4,0.1"
    assert data_of(text, "records_1").split() == record.split()
    data = made_up()
    data["plateau_mean"][1] = 0.3
    answer = data_of(report_page.page(data, []), "plateau_mean_over_intrinsic_friction").splitlines()
    assert answer[1].startswith("0.25,0.57284,")
    assert answer[2] == "0.5,0.6,,False"


def test_single_cases_that_are_left_out_are_counted(monkeypatch):
    monkeypatch.setattr(report_page, "MOST_SINGLE", 1)
    dataset = made_up(drives=3)
    dataset["trajectory_id"][0, 0] = ["t", "u", "v"]
    group = groups_of(dataset)["trajectory"].isel(trajectory=[0, 0, 0], sample=[0, 1] * 3)
    group = group.assign_coords(trajectory=["t", "u", "v"])
    found = report_page.section(carrying(dataset, {**groups_of(dataset), "trajectory": group}), SORTS["drives"])
    assert found is not None
    assert (len(found.large), len(found.single)) == (1, 1)
    assert found.notes == ("1 of 3 single cases are drawn small, spread over all axes; 2 are not shown.",)


def test_sections_of_one_figure_stand_side_by_side_unless_many_small_ones_go_with_it():
    def sized(large: int, small: int = 0) -> report_page.Section:
        return report_page.Section("", (None,) * large, (None,) * small, ())  # type: ignore[arg-type]

    sections = sized(3), sized(1), sized(1, 6), sized(0), sized(2), sized(1, 7), sized(1)
    found = [place for place, _ in report_page.placed(sections)]
    assert found == ["", "half", "half", "alone", "", "many", "alone"]


def test_the_answer_stands_before_what_is_behind_it(failing):
    text = failing.read_text("utf-8")
    places = [
        text.index(f"<h2>{title}</h2>") for title in ("Answer", "Friction records", "Cases", "About these numbers")
    ]
    assert places == sorted(places)


def test_a_dataset_of_words_alone_has_a_table_and_no_figures(tmp_path):
    only = made_up()[["outcome", "message"]]
    assert summary.scalar_table(only).header == ("μ_i", "outcome")
    text = report_page.write(only, tmp_path).read_text("utf-8")
    assert "<img" not in text
    assert "No case has numbers" in text


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match=r"report\.html: cannot be written"):
        report_page.write(made_up()[["outcome", "message"]], Path(tmp_path / "file"))


def test_symbols_have_their_indices_lowered_and_names_of_keys_stay_as_they_are() -> None:
    """And nothing of a title becomes HTML."""
    assert str(report_page.lowered("R/L_x & W/(G·L_x·L_y) <b>")) == (
        "R/L<sub>x</sub> &amp; W/(G·L<sub>x</sub>·L<sub>y</sub>) &lt;b&gt;"
    )
    assert str(report_page.lowered("bottom_row, near_ends, _x, stick_slip")) == "bottom_row, near_ends, _x, stick_slip"
