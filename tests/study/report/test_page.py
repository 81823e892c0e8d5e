"""The report shows what the dataset holds, needs no other file, and copes with datasets that are not complete."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from study.dataset.groups import carrying
from study.dataset.store import StoreError
from study.report import page as report_page
from study.report import summary

PNG = b"\x89PNG\r\n\x1a\n"


def made_up(design: str = "product", outcome: str = "completed", drives: int = 1) -> xr.Dataset:
    """Two cases with two events each, as `study.dataset.collect` lays them out."""
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
        "plateau_uncertainty": over_cases([0.00042, np.nan]),
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
    assert table.header == ("μ_i", "plateau F/W", "μ_s", "μ_k", "peak F/W", "events", "δ_p/L_x", "outcome")
    assert table.rows[0] == ("0.25", "0.1432 ± 0.0004", "0.15", "0.14", "0.2", "2", "0.4", "completed")


def test_a_case_without_numbers_shows_dashes_and_its_advice():
    row = summary.scalar_table(made_up(outcome="invalid")).rows[1]
    assert row == ("0.5", "–", "–", "–", "–", "–", "–", "invalid: do < this > instead")


@pytest.mark.parametrize("design", ["product", "case"])
def test_several_drives_are_rows_of_their_own(design):
    table = summary.scalar_table(made_up(design, drives=2))
    assert table.header[:2] == ("μ_i", "drive")
    assert [row[:2] for row in table.rows[:2]] == [("0.25", "pull/0"), ("0.25", "pull/1")]


def test_there_is_a_figure_for_each_record_and_each_drive_that_exists():
    names = [picture.name for picture in report_page.pictures(made_up(drives=2))]
    assert names == ["record_aaaa", "trajectory_all", "trajectory_aaaa_pull-0", "trajectory_aaaa_pull-1"]
    assert all(picture.png.startswith(PNG) for picture in report_page.pictures(made_up()))


def test_a_record_is_drawn_as_its_sawtooth(monkeypatch):
    drawn = []

    class Axes:
        def plot(self, x, y, **_):
            drawn.append((x.values.tolist(), y.values.tolist()))

        def set(self, **_):
            pass

    dataset = made_up()
    point = next(summary.points(dataset, "record_id"))
    report_page._draw_record(Axes(), dataset, point)
    assert drawn == [([0.0, 0.1, 0.1, 0.3, 0.3, 0.4], [0.0, 0.10, 0.05, 0.12, 0.06, 0.1])]


def test_the_page_holds_all_of_it_and_needs_no_other_file(tmp_path):
    page, *figures = report_page.write(made_up(), tmp_path)
    text = page.read_text("utf-8")
    assert [figure.parent.name for figure in figures] == ["figures"] * 2
    assert text.count("data:image/png;base64,") == len(figures)
    assert "http" not in text
    assert "0.1432 ± 0.0004" in text
    assert "Made &lt;up&gt;" in text
    assert "Made <up>" not in text


def test_a_dataset_of_contacts_alone_has_a_table_and_no_figures(tmp_path):
    only = made_up()[["outcome", "message"]]
    assert summary.scalar_table(only).header == ("μ_i", "outcome")
    assert len(report_page.write(only, tmp_path)) == 1


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="cannot write the report there"):
        report_page.write(made_up(), Path(tmp_path / "file"))
