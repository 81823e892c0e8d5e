"""What is said of a dataset in a few lines: a row for each case, endings counted, failures named, runs and their cost, tables."""

import csv
import io
import json
import math
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from rich.console import Console

from nanoslip.solver.drive import Scales
from nanoslip.study import api
from nanoslip.study.dataset.access import Column
from nanoslip.study.dataset.flat import as_csv, as_json
from nanoslip.study.dataset.table import one_case
from nanoslip.study.dataset.variables import describe
from nanoslip.study.report.console import Table
from nanoslip.study.report.page import cost
from nanoslip.study.report.single_case import answer, case_table, ending_lines
from nanoslip.study.report.summary import (
    FEW,
    cautions,
    drive_summary,
    endings,
    factor_out_columns,
    failure_summary,
    format_number,
    label_text,
    scalar_table,
    short_summary,
)
from nanoslip.study.results.attempts import RunRecord
from tests.study.figures.cases import product
from tests.study.report.test_page import made_up

CONTACTS = {
    "title": "Contacts",
    "stages": ["contact"],
    "axes": {"normal_load": [1e-4, 1e-3]},
    "constants": {"radius": 50.0},
    "numerics": {"n_x": 33},
}


MIXED = {"stick_slip": 13, "sticks": 2, "slides": 1}


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


def failing(
    endings: list[str], messages: list[str], drives: list[list[str]] | None = None, causes: list[str] | None = None
) -> xr.Dataset:
    """Cases over load that ended so; with drives, whose messages are given, they ended as no_slip or as their case."""
    load = ("normal_load",)
    variables = {
        "outcome": (load, np.array(endings, dtype=object)),
        "message": (load, np.array(messages, dtype=object)),
        "cause": (load, np.array(causes or [""] * len(endings), dtype=object)),
    }
    if drives:
        texts = np.array(drives, dtype=object)
        words = np.where(texts == "", "completed", "no_slip").astype(object)
        both = ("normal_load", "drive")
        variables |= {"drive_outcome": (both, words), "drive_message": (both, texts)}
    found = xr.Dataset(variables, {"normal_load": 10.0 ** -np.arange(1, len(endings) + 1)})
    return found.assign_coords(drive=["a", "b"]) if drives else found


def test_every_drive_of_the_axes_is_a_row_that_names_its_place() -> None:
    table = scalar_table(over_axes())
    assert table.header == ("k (N/m)", "V_o (m/s)", "μ_s", "regime", "outcome")
    assert table.rows[1] == ("1e4", "0.002", "0.3", "slides", "completed")
    assert table.rows[4] == ("1e5", "0.002", "0.3", "–", "invalid: needs another value")
    assert table.rows[5][3] == "stick-slip"
    flagged = scalar_table(over_axes().assign(validity_flags=("intrinsic_friction", [1])))
    assert (flagged.header[-1], flagged.rows[1][-1]) == ("outcome [flag]", "completed [few_nodes]")
    assert scalar_table(over_axes(), why=False).rows[4][-1] == "invalid"


def test_the_period_of_stick_slip_is_in_the_table_where_a_drive_has_one() -> None:
    dims, found = ("intrinsic_friction", "spring_stiffness", "stage_velocity"), over_axes()
    periods = np.full((1, 2, 3), np.nan)
    assert "period (s)" not in scalar_table(found.assign(stick_slip_period=(dims, periods))).header
    periods[0, 1, 2] = 0.25
    table = scalar_table(found.assign(stick_slip_period=(dims, periods)))
    assert table.header == ("k (N/m)", "V_o (m/s)", "μ_s", "regime", "period (s)", "outcome")
    assert [row[4] for row in table.rows] == ["–"] * 5 + ["0.25"]


def test_numbers_are_still_there_where_members_differ_in_their_regime_and_a_terminal_is_narrow() -> None:
    """The regime is an answer, too: it is never left out, however narrow the terminal."""
    mixed = over_axes().isel(spring_stiffness=[0], stage_velocity=[1, 2])
    mixed["regime"][:] = "stick_slip"
    mixed = mixed.assign({f"regime_{word}_members": count for word, count in MIXED.items()})
    said = io.StringIO()
    Console(file=said, width=45).print(scalar_table(mixed))
    assert "regime" in said.getvalue()
    assert "not shown" not in said.getvalue()


def test_a_pin_that_follows_in_micro_slips_is_an_answer_and_a_number_of_the_target_that_it_lacks_none() -> None:
    """No red badge, row or sentence; one that only sticks was not pulled long enough."""
    data = over_axes().isel(spring_stiffness=[0], stage_velocity=[1, 2])
    data["static_friction"] = data["static_friction"] * np.nan
    data["drive_outcome"][:] = "no_slip"
    data["drive_message"][:] = "its slips are too short"
    plain = scalar_table(data.assign(plateau_mean=data["static_friction"].fillna(0.3)))
    assert "plateau F/W" in plain.header[: plain.labels + plain.asked]  # its friction
    for word, red in (("micro_slip", False), ("sticks", True)):
        data["regime"][:] = word
        assert bool(scalar_table(data).failed) == red
        assert bool(failure_summary(data)) == red
        assert dict(endings(data))["2 drives: no slip"] == red
    known = data.assign(
        critical_velocity=data["static_friction"].fillna(0.01)
    )  # the question was where it ceases to stick
    assert (
        scalar_table(known).failed,
        list(failure_summary(known).values()),
        dict(endings(known))["2 drives: no slip"],
    ) == (
        set(),
        [],
        False,
    )
    data["regime"][:] = "micro_slip"
    data.attrs["manifest"] = '[target]\nwithin = 0.01\nof = ["static_friction"]'
    assert scalar_table(data).failed == {0, 1}


def test_flags_that_all_rows_have_are_said_once_below() -> None:
    """They took the width of numbers, in every row."""
    data = ensembles([0.01, 0.01]).assign(outcome=("normal_load", ["completed"] * 2), message=("normal_load", [""] * 2))
    for masks, title, cell in (([1, 1], "outcome", "completed"), ([1, 0], "outcome [flag]", "completed [few_nodes]")):
        table = scalar_table(data.assign(validity_flags=("normal_load", np.array(masks, np.int32))))
        assert (table.header[-1], table.rows[0][-1]) == (title, cell)


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


def test_numbers_that_are_known_unfinished_or_asked_for_by_nobody_are_not_short_of_anything() -> None:
    assert short_summary(ensembles([0.009, 0.01])) == []
    assert short_summary(ensembles([np.nan])) == []
    assert short_summary(ensembles([0.02], asked="[ensemble]\nmembers = 8")) == []
    assert short_summary(ensembles([0.02], asked='[target]\nwithin = 0.02\nof = ["static_friction"]')) == []
    assert short_summary(xr.Dataset()) == []


def test_what_the_spacing_decides_is_said_apart_from_what_more_starts_would_know() -> None:
    """Both count: 1 % by starts and 1.5 % by the spacing are more than 2 %."""
    data = ensembles([0.002, 0.005, 0.02, 0.002])
    assert len(short_summary(data)) == 1
    changes = data.assign(spacing_change=("normal_load", [0.001, 0.015, 0.001, 0.03]))
    by_spacing, by_starts = short_summary(changes)
    assert "3.0%" in by_spacing
    assert "n_x" in by_spacing
    assert "target.most" not in by_spacing
    assert "target.most" in by_starts
    assert "2 of 4" in by_starts
    assert short_summary(changes.isel(normal_load=[0])) == []
    assert short_summary(changes.assign(spacing_change=("normal_load", 4 * [math.nan]))) == short_summary(data)


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


def test_the_half_width_of_a_punch_and_that_of_its_contact_have_titles_of_their_own() -> None:
    punches = product(half_width=[0.01, 0.1], intrinsic_friction=[0.2])
    table = scalar_table(punches.assign(contact_half_width=punches["plateau_mean"]))
    assert len(set(table.header)) == len(table.header)
    assert table.header[0] == "a/L_x"


def declared(data: xr.Dataset) -> xr.Dataset:
    for name in data.data_vars:
        data[name].attrs |= {"long_name": f"meaning of {name}", "units": "1"}
    data["final_displacement"].attrs["units"] = "m"
    return data


def test_what_failed_is_said_and_its_numbers_are_named_as_missing():
    case = one_case(declared(made_up(outcome="contact_lost")), {"intrinsic_friction": "0.5"})
    assert list(ending_lines(case)) == ["outcome: contact_lost: do < this > instead", "drive: contact_lost"]
    table, missing = case_table(case)
    assert table.rows == ()
    assert {"plateau_mean", "static_friction"} <= set(missing["not known here"])
    assert answer(case) == "contact_lost: do < this > instead"


def test_a_mean_has_its_uncertainty_and_how_many_members_have_the_number() -> None:
    numbers = {"plateau_mean": 2.0, "plateau_mean_uncertainty": 0.5, "plateau_mean_members": 5.0, "members": 8.0}
    case = xr.Dataset({name: ((), value, {"long_name": name}) for name, value in numbers.items()})
    table, _ = case_table(case)
    assert [row[:2] for row in table.rows] == [("plateau_mean", "2.0 ± 0.5 (5 of 8 starts)")]
    assert list(ending_lines(case))[-1].startswith("numbers are means")
    assert answer(case) == "plateau F/W 2.0 ± 0.5"


def test_an_answer_begins_with_its_size_in_si_and_a_drive_without_slip_is_named_by_its_regime() -> None:
    scales = Scales(shear_modulus=1e6, slab_width=4e-3, slab_depth=4e-3)  # a load of 1/16 is 1 N
    loss = {"normal_load": 0.0625, "loss_per_cycle": 0.5, "loss_per_cycle_uncertainty": 0.025}
    case = xr.Dataset(loss, attrs=asdict(scales)).set_coords("normal_load")
    assert answer(case).endswith(" 2.00 ± 0.10 mJ, loss/(W·L_x) 0.50 ± 0.03")
    assert label_text({"normal_load": 0.0625, "radius": 1.25, "n_x": 9}, scales) == "W = 1 N, R = 5 mm, n_x = 9"
    endings = {"outcome": "completed", "message": "", "drive_outcome": "no_slip", "drive_message": "pull harder"}
    stuck = xr.Dataset(endings)
    assert (answer(stuck), answer(stuck.assign(regime="micro_slip"))) == ("no_slip: pull harder", "regime micro-slip")


def test_the_cost_is_that_of_all_runs_or_unknown() -> None:
    assert cost([]).startswith("Not known")
    assert cost([KILLED]).startswith("Not known")
    assert (
        cost([ONE, EIGHT])
        == "2 min in 2 runs with up to 8 processes; 10 tasks took 3.33 min, of which 2 min of processor time."
    )
    assert cost([ONE]) == "60 s in one run with one process; 5 tasks took 100 s, of which 60 s of processor time."
    assert cost([ONE, KILLED]).endswith("their end.")


MANY = ("k (N/m)", "regime", "plateau F/W", "μ_s", "μ_k", "outcome")


def test_a_column_that_never_changes_is_said_once_but_labels_and_endings_stay() -> None:
    plateau = "0.2739 ± 0.0003"
    rows = ("1e5", "slides", plateau, "0.30", "–", "completed"), ("2e5", "slides", plateau, "0.31", "–", "completed")
    left = ("1e5", "0.30", "completed"), ("2e5", "0.31", "completed")
    found, said = factor_out_columns(Table(MANY, rows, 1, frozenset({1})))
    assert found == Table(("k (N/m)", "μ_s", "outcome"), left, 1, frozenset({1}))
    assert said == [f"In all rows: regime = slides, plateau F/W = {plateau}.", "Not known in any row: μ_k."]
    two = Table(("n_x", "drive", "events", "outcome"), (("17", "a", "5", "done"), ("17", "b", "5", "done")), 2)
    left = ("17", "a", "done"), ("17", "b", "done")
    assert factor_out_columns(two) == (Table(("n_x", "drive", "outcome"), left, 2), ["In all rows: events = 5."])


@pytest.mark.parametrize(
    "table",
    [
        Table(MANY, (("1e5", "slides", "0.27", "0.30", "–", "completed"),)),
        Table(("n_x", "μ_s", "outcome"), (("17", "0.3", "completed"), ("17", "–", "completed"))),
    ],
)
def test_a_single_row_and_rows_that_differ_stay_as_they_are(table: Table) -> None:
    assert factor_out_columns(table) == (table, [])


def test_a_large_whole_number_is_written_whole_and_others_in_their_digits() -> None:
    written = [format_number(value, 5) for value in (199880.0, 2000.0, 0.123456, 275649123.5, 1e30)]
    assert written == ["199\N{NO-BREAK SPACE}880", "2000", "0.12346", "2.7565e+08", "1e+30"]


def test_the_endings_and_regimes_of_many_drives_are_counted_by_what_most_members_did() -> None:
    many = xr.concat([over_axes()] * 10, "pin_mass", data_vars="all")
    said = [
        "drive_outcome of 60 drives: 50 completed, 10 invalid",
        "regime of 60 drives: 30 slides, 10 sticks, 10 stick-slip",
    ]
    assert drive_summary(many) == said
    assert over_axes().regime.size < FEW
    assert drive_summary(over_axes()) == []  # which need no count


FIRST = "first W/(G·L_x·L_y)"


FAILURES = {
    "that say the same are one line with their number and the first of them": (
        failing(["cascade_limit", "completed", "cascade_limit", "steep_pin"], ["raise it", "", "raise it", "lower it"]),
        [f"cascade_limit: 2 of 4 cases, {FIRST} = 0.1: raise it", f"steep_pin: 1 of 4 cases, {FIRST} = 1e-4: lower it"],
    ),
    "of one cause are one line that says so": (
        failing(
            ["no_plateau"] * 3,
            ["rises by 3.5%: more", "rises by 1e-3%: more", "falls by 3.5%: more"],
            causes=["rises", "rises", "falls"],
        ),
        [
            f"no_plateau: 2 of 3 cases, {FIRST} = 0.1: rises by 3.5%: more; the others differ in numbers",
            f"no_plateau: 1 of 3 cases, {FIRST} = 0.001: falls by 3.5%: more",
        ],
    ),
    "that a drive inherits from its case are said once": (
        failing(
            ["no_slip", "completed"],
            ["too flat", ""],
            [["too flat", "none to repeat: too flat"], ["", "soften the spring"]],
        ),
        [
            f"no_slip: 1 of 2 cases, {FIRST} = 0.1: too flat",
            f"no_slip: 1 of 4 drives, {FIRST} = 0.01, drive = b: soften the spring",
        ],
    ),
    "are not what is pending or completed": (failing(["completed", "pending"], ["", ""]), []),
}


@pytest.mark.parametrize(("data", "said"), FAILURES.values(), ids=FAILURES)
def test_failures_are_a_line_for_each_reason(data: xr.Dataset, said: list[str]) -> None:
    assert list(failure_summary(data).values()) == said


SHORT = f"plateau_mean is not known within 0.02: {{}} of 3 cases, {FIRST} = 2e-4; {{}}"


def test_numbers_less_known_than_was_asked_for_are_counted_with_the_first_and_the_worst() -> None:
    found = short_summary(ensembles([0.009, 0.011, 0.034]))
    assert found == [SHORT.format(2, "the worst to 6.8%; raise target.most, or limits.presliding")]


def test_complete_cases_without_a_mean_asked_for_are_counted_too() -> None:
    """A drive that slides has no stick-slip period, however many members there are; an unfinished one has none yet."""
    found = ensembles([0.01, np.nan, np.nan])
    found["plateau_mean"][1:] = np.nan
    found["outcome"] = "normal_load", ["completed", "completed", "pending"]
    assert short_summary(found) == [SHORT.format(1, "members lack a value, or do not differ")]


def test_a_list_of_cases_is_labelled_by_what_its_author_lists_and_not_by_what_follows() -> None:
    axes = {"n_x": [33, 65], "radius": [50.0, 20.0]}
    found = api.run({**CONTACTS, "design": "zip", "axes": axes, "constants": {"normal_load": 1e-4}, "numerics": {}})
    assert len(set(found.bottom_row.values.tolist())) == 2
    assert scalar_table(found).header[:3] == ("R/L_x", "n_x", "a/L_x")


def test_what_has_ended_is_in_a_table_before_what_has_not_and_the_rest_is_counted() -> None:
    data = failing(["pending"] * 7 + ["completed", "pending", "invalid"], [""] * 10)
    table = scalar_table(data, most=4)
    assert [row[-1] for row in table.rows] == ["pending", "pending", "completed", "invalid", "6 more"]
    assert table.failed == {3}
    assert {len(row) for row in table.rows} == {len(table.header)}
    assert len(scalar_table(data, most=10).rows) == 10


@pytest.mark.parametrize("design", ["product", "case"])
def test_every_scalar_is_in_the_table_of_its_case_once_with_unit_and_meaning(design: str) -> None:
    data = declared(made_up(design))
    data = data.assign(own=data["peak_friction"].assign_attrs(units="N m-1", long_name="of a later version"))
    table, others = case_table(one_case(data, {"intrinsic_friction": "0.25"}))
    apart = {name for name in data.data_vars if name.endswith(("outcome", "message", "_id", "_uncertainty"))}
    names = [*(row[0] for row in table.rows), *others.pop("0 here", [])]
    assert sorted(names) == sorted(set(data.data_vars) - apart)
    assert (names[:2], others) == (["static_friction", "kinetic_friction"], {})
    assert {
        ("plateau_mean", "0.1432 ± 0.0004", describe("plateau_mean").meaning),
        ("final_displacement", "0.4 L_x", describe("final_displacement").meaning),
        ("own", "0.2 N/m", "of a later version"),
    } <= set(table.rows)


NAN, INF = float("nan"), float("inf")


COLUMNS = [
    Column("radius", "1", "radius of the pin", [0.1 + 0.2, 1e-300, INF]),
    Column("events", "1", "events", [2**53 + 1, 0, -1]),
    Column("stage_velocity", "m s-1", "velocity", [NAN, 1.0, 2.0]),
    Column("friction", "", "switch", [True, False, True]),
    Column("message", "", "why", ["", 'raise "n_x", or\nlower it, #1', "μ_i"]),
]


def test_csv_has_units_in_its_names_and_is_read_by_pandas() -> None:
    header, first, *_ = csv.reader(io.StringIO(as_csv(COLUMNS)))
    assert header == ["radius", "events", "stage_velocity [m s-1]", "friction", "message"]
    assert first == ["0.30000000000000004", "9007199254740993", "", "true", ""]
    found = pd.read_csv(io.StringIO(as_csv(COLUMNS)), keep_default_na=False, na_values={"stage_velocity [m s-1]": ""})
    for name, each in zip(found, COLUMNS, strict=True):
        np.testing.assert_array_equal(found[name], each.values)


def test_texts_with_separators_and_ends_of_lines_are_read_back_as_they_were() -> None:
    texts = ["a,b", 'a "b"', "a;b", "a\nb", "a\rb", "a\r\nb", " a ", "", "#a", "'a", "μ\u2028"]
    text = as_csv([Column("a,b", "m\r", "", texts), Column("b\rc", "", "", [0.1] * len(texts))])
    header, *rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    assert (header, [row[0] for row in rows]) == (["a,b [m\r]", "b\rc"], texts)
    found = pd.read_csv(io.BytesIO(text.encode()), keep_default_na=False)
    assert (list(found), found["a,b [m\r]"].tolist(), set(found["b\rc"])) == (header, texts, {0.1})


def test_no_cell_of_csv_is_a_formula_and_numbers_stay_numbers() -> None:
    cells = ["=1+1", "@now", "+cmd", "-x", "-1.5e-3", "-inf", "a=b", ""]
    rows = [row[0] if row else "" for row in csv.reader(io.StringIO(as_csv([Column("text", "", "", cells)])))]
    assert rows == ["text", "'=1+1", "'@now", "'+cmd", "'-x", *cells[4:]]


def test_json_is_strict_and_says_units_and_meanings() -> None:
    found = json.loads(as_json(COLUMNS, 'A "title"'), parse_constant=pytest.fail)
    assert found["title"] == 'A "title"'
    assert found["variables"]["stage_velocity"] == {"units": "m s-1", "long_name": "velocity"}
    assert [row["radius"] for row in found["rows"]] == [0.1 + 0.2, 1e-300, "inf"]
    assert [row["stage_velocity"] for row in found["rows"]] == [None, 1.0, 2.0]
    assert found["rows"][1]["message"] == COLUMNS[4].values[1]


ONE = RunRecord(
    run="a",
    begun="2026-01-01T00:00:00+00:00",
    processes=1,
    command="nanoslip run a",
    solver="5017e2",
    processor="a processor",
    libraries={"numpy": "2.4.6"},
    ended="2026-01-01T00:01:00+00:00",
    done=4,
    failed=1,
    wall_seconds=60.0,
    core_seconds=100.0,
    processor_seconds=60.0,
)


EIGHT = replace(ONE, run="b", processes=8, unit="ranks", hosts={"n1": 5, "n2": 3}, exit_code=99)


KILLED = replace(ONE, run="c", ended="", wall_seconds=0.0, core_seconds=0.0)


def test_a_number_that_was_not_asked_for_is_no_failure() -> None:
    """A drive that ends after its first slip was pulled for μ_s alone; one that never slips has nothing."""
    soft = {"spring_stiffness": 2e4}
    drives = [{"name": "first", "max_slips": 1, **soft}, {"name": "short", "duration": 0.1, **soft}]
    campaign = {"title": "x", "numerics": {"n_x": 33}, "ensemble": {"members": 1}, "drives": drives}
    data = api.run(campaign, progress=False)
    assert scalar_table(data).failed == {1}
    (line,) = failure_summary(data).values()
    assert line.startswith("no_slip: 1 of 2 drives")
    assert any(line.startswith("no_plateau: 1 of 2 drives") for line in cautions(data))


@pytest.mark.parametrize(
    ("added", "parts"), [(0.415, "(0.498 + 0.415)"), (0.08, "(0.833 + 0.08)"), (0.003, ""), (np.nan, "")]
)
def test_static_friction_by_inertia_and_damper_stands_beside_the_contacts_own(added: float, parts: str) -> None:
    case = xr.Dataset({"static_friction": 0.913, "static_friction_uncertainty": 0.004, "static_friction_excess": added})
    assert answer(case) == f"μ_s 0.913 ± 0.004 {parts}".rstrip()
    assert len(drive_summary(case)) == (added == 0.415)  # advice begins at a tenth
