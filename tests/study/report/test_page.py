"""The report shows what the dataset holds, needs no other file, follows the page's colours, and says in words what is missing."""

import base64
import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.file import carrying
from nanoslip.study.figures.shared import COLORS, column, image
from nanoslip.study.report import page as report_page, summary
from nanoslip.study.report.page import DARK, missing_groups, sizes_in_si, theme_svg
from nanoslip.study.results.store import StoreError


def texts(*words: str) -> tuple[str, np.ndarray]:
    """Words of cases."""
    return "case", np.array(words, dtype=object)


def made_up(design: str = "product", outcome: str = "completed", drives: int = 1) -> xr.Dataset:
    """Two cases with two events each, as `nanoslip.study.dataset.collect` lays them out; the second has no numbers."""
    listed = design == "case"
    dims = ("case",) if listed else ("intrinsic_friction", "n_x")

    def over_cases(*values: Any) -> tuple[tuple[str, ...], np.ndarray]:
        return dims, np.array(values, dtype=object if isinstance(values[0], str) else None).reshape(
            2, *dims[1:] and (1,)
        )

    def over_drives(*values: Any) -> tuple[tuple[str, ...], np.ndarray]:
        many = over_cases(*values)[1]
        return (dims, many) if drives == 1 else ((*dims, "drive"), np.stack([many] * drives, axis=-1))

    coordinates = {
        "intrinsic_friction": ("case" if listed else "intrinsic_friction", [0.25, 0.5]),
        "n_x": ("case", [17, 17]) if listed else ("n_x", [17]),
        "case_id": over_cases("aaaa", "bbbb"),
        "drive": ((), "pull") if drives == 1 else ("drive", [f"pull/{number}" for number in range(drives)]),
    }
    of_cases = {
        "plateau_mean": 0.14321,
        "plateau_mean_uncertainty": 0.00042,
        "peak_friction": 0.2,
        "events": 2.0,
        "initial_force": 0.0,
        "final_displacement": 0.4,
        "final_force": 0.1,
    }
    variables = {name: over_cases(value, np.nan) for name, value in of_cases.items()} | {
        "outcome": over_cases("completed", outcome),
        "message": over_cases("", "" if outcome == "completed" else "do < this > instead"),
        "static_friction": over_drives(0.15, np.nan),
        "kinetic_friction": over_drives(0.14, np.nan),
        "drive_outcome": over_drives("completed", outcome),
        "drive_message": over_drives("", ""),
        "record_id": over_cases("r", ""),
        "trajectory_id": over_drives("t", ""),
    }
    forces = {"event_force_before": ("event", [0.10, 0.12]), "event_force_after": ("event", [0.05, 0.06])}
    samples = {"trajectory_row_size": ("trajectory", [2]), "sample_spring_force": ("sample", [0.0, 0.2])}
    groups = {
        "record": xr.Dataset(
            {"row_size": ("record", [2]), **forces}, {"record": ["r"], "displacement": ("event", [0.1, 0.3])}
        ),
        "trajectory": xr.Dataset(samples, {"trajectory": ["t"], "time": ("sample", [0.0, 0.1])}),
    }
    attributes = {"title": "Made <up>", "manifest": 'title = "Made <up>"', "source_commit": "abc"}
    found = xr.Dataset(variables, coordinates, attributes)
    return carrying(found.assign_coords(case=[0, 1]) if listed else found, groups)


def test_a_case_without_numbers_shows_dashes_and_its_advice():
    table = summary.scalar_table(made_up(outcome="invalid"))
    assert table.header == ("μ_i", "μ_s", "μ_k", "plateau F/W", "peak F/W", "events", "δ_p/L_x", "outcome")
    assert table.rows[0] == ("0.25", "0.15", "0.14", "0.1432 ± 0.0004", "0.2", "2", "0.4", "completed")
    assert table.rows[1] == ("0.5", "–", "–", "–", "–", "–", "–", "invalid: do < this > instead")


@pytest.fixture(scope="module")
def failing(tmp_path_factory) -> str:
    """The page of one completed and one invalid case, alone in its folder."""
    path = report_page.write_page(made_up(outcome="invalid"), tmp_path_factory.mktemp("page"))
    assert [each.name for each in path.parent.iterdir()] == [report_page.FILE]
    return path.read_text("utf-8")


def test_the_page_holds_all_of_it_and_needs_no_other_file(failing):
    assert failing.count('<img src="data:image/svg+xml;base64,') == failing.count("<img") == 2  # record and drive
    mu = "μ<sub>i</sub>"
    for said in (
        f"F/W on the plateau over {mu}: 0.5728 ± 0.0017 at {mu} = 0.25, the only one of 2 that has it.",
        "0.1432 ± 0.0004",
        "Made &lt;up&gt;",
        "Lines of many points are thinned",
        "Not known: nothing beside the dataset says",
    ):
        assert said in failing
    assert "http" not in failing
    assert "Made <up>" not in failing


def test_failures_come_first_each_with_its_advice_and_the_answer_before_what_is_behind_it(failing):
    assert failing.index('<span class="bad">1 case: invalid') < failing.index('<span class="good">1 case: completed')
    assert ": do &lt; this &gt; instead</li>" in failing
    assert '<tr class="bad"><td>0.5</td>' in failing
    titles = ("Answer", "Friction records", "Cases", "About these numbers")
    places = [failing.index(f"<h2>{title}</h2>") for title in titles]
    assert places == sorted(places)


def test_advice_is_red_only_where_something_failed(failing):
    assert '<section class="advice bad">' in failing
    advised = made_up()
    advised["drive_message"][:] = "its period is not known: raise stage_travel"
    told = report_page.page(advised, [])
    assert '<section class="advice">' in told
    assert "raise stage_travel</li>" in told


def test_the_numbers_of_a_figure_are_behind_its_link(failing):
    record = "displacement,friction_force 0,0 0.1,0.1 0.1,0.05 0.3,0.12 0.3,0.06 0.4,0.1"
    assert data_of(failing, "records_1").split() == record.split()
    data = made_up()
    data["plateau_mean"][1] = 0.3
    answer = data_of(report_page.page(data, []), "plateau_mean_over_intrinsic_friction").splitlines()
    assert answer[1].startswith("0.25,0.57284,")
    assert answer[2] == "0.5,0.6,,False"


def test_a_dataset_of_words_alone_has_a_table_and_no_figures(tmp_path):
    only = made_up()[["outcome", "message"]]
    assert summary.scalar_table(only).header == ("μ_i", "outcome")
    text = report_page.write_page(only, tmp_path).read_text("utf-8")
    assert "<img" not in text
    assert "thinned" not in text
    assert "No case" in text
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match=r"report\.html: "):
        report_page.write_page(only, tmp_path / "file")


def test_sizes_are_said_in_si_and_left_out_where_a_dataset_does_not_say() -> None:
    step = {"long_name": "mean step per event", "units": "m"}
    data = xr.Dataset({"mean_step_si": ("radius", [1e-9, np.nan, 2e-9], step)}, {"radius": [50.0, 100.0, 200.0]})
    assert list(sizes_in_si(data)) == []
    assert list(sizes_in_si(data.assign_attrs(slab_width=1e-3, slab_depth=1e-2, shear_modulus=1e10))) == [
        "L_x = 1 mm, R = 50 to 200 mm, W = 100 N, L_z = 1 mm, L_y = 10 mm, G = 10 GPa, E = 26.67 GPa, nodes 7.812 μm apart",
        "Mean step per event: 1 to 2 nm",
    ]


def test_records_that_are_not_kept_are_named() -> None:
    data = xr.Dataset({"plateau_mean": ("case", [0.5])})
    (said,) = missing_groups(data)
    assert "[outputs]" in said
    kept = data.assign(record_id=("case", ["r"]))
    (said,) = missing_groups(kept)
    assert "[outputs] statistics" in said
    assert list(missing_groups(kept.assign(slips_exponent=("case", [1.5])))) == []


def drawn() -> object:
    with column() as figure:
        axes = figure.add_subplot()
        for number in range(len(COLORS)):
            axes.plot([0, 1], [0, number], "o-", label=f"line {number}")
        axes.legend()
    return figure


def test_every_colour_is_a_variable_with_a_light_and_a_dark_value() -> None:
    text = theme_svg(image(drawn(), "svg").decode())
    ElementTree.fromstring(text)
    style, _, rest = text.partition("</style>")
    assert not re.findall(rf"(?:fill|stroke): ?(?:{'|'.join(COLORS)}|#000000)", rest)
    used = set(re.findall(r"var\(--(\w+)\)", rest))
    assert used >= {f"c{number}" for number in range(len(COLORS))}
    for values in style.split("@media(prefers-color-scheme:dark)"):
        assert all(f"--{name}:" in values for name in used)
    assert len(DARK) == len(COLORS)


def data_of(text: str, name: str) -> str:
    """The file behind a link of the page."""
    found = re.search(rf'download="{name}.csv" href="data:text/csv;base64,([^"]*)"', text)
    assert found, name
    return base64.b64decode(found[1]).decode()


def test_sections_of_one_figure_stand_side_by_side():
    sections = [report_page.Section("", (None,) * large, ()) for large in (3, 1, 1, 0, 2, 1)]  # type: ignore[arg-type]
    found = [place for place, _ in report_page.place_sections(sections)]
    assert found == ["", "half", "half", "alone", "", "alone"]


def test_symbols_have_their_indices_lowered_and_names_of_keys_stay_as_they_are() -> None:
    """And nothing of a title becomes HTML."""
    assert str(report_page.lower_subscripts("R/L_x & W/(G·L_x·L_y) <b>")) == (
        "R/L<sub>x</sub> &amp; W/(G·L<sub>x</sub>·L<sub>y</sub>) &lt;b&gt;"
    )
    assert (
        str(report_page.lower_subscripts("bottom_row, near_ends, _x, stick_slip"))
        == "bottom_row, near_ends, _x, stick_slip"
    )
