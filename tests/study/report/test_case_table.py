"""The numbers of a case are all there: with uncertainty, unit and meaning, or by name among those that are missing."""

import xarray as xr

from nanoslip.study.dataset.access import one_case
from nanoslip.study.report.summary import case_table, ending_lines
from tests.study.report.test_page import made_up


def declared(data: xr.Dataset) -> xr.Dataset:
    for name in data.data_vars:
        data[name].attrs |= {"long_name": f"meaning of {name}", "units": "1"}
    data["final_displacement"].attrs["units"] = "m"
    return data


def test_every_scalar_is_in_the_table_once_or_missing():
    data = declared(made_up())
    table, missing = case_table(one_case(data, {"intrinsic_friction": "0.25"}))
    names = [row[0] for row in table.rows]
    apart = {name for name in data.data_vars if name.endswith(("outcome", "message", "_id", "_uncertainty"))}
    assert sorted([*names, *missing]) == sorted(set(data.data_vars) - apart)
    assert ("plateau_mean", "0.1432 ± 0.0004", "meaning of plateau_mean") in table.rows
    assert ("final_displacement", "0.4 m", "meaning of final_displacement") in table.rows
    assert missing == []


def test_what_failed_is_said_and_its_numbers_are_named_as_missing():
    case = one_case(declared(made_up(outcome="contact_lost")), {"intrinsic_friction": "0.5"})
    assert list(ending_lines(case)) == ["outcome: contact_lost: do < this > instead", "drive: contact_lost"]
    table, missing = case_table(case)
    assert table.rows == ()
    assert {"plateau_mean", "static_friction"} <= set(missing)


def test_a_mean_has_its_uncertainty_and_how_many_members_have_the_number() -> None:
    numbers = {"plateau_mean": 2.0, "plateau_mean_uncertainty": 0.5, "plateau_mean_members": 5.0, "members": 8.0}
    case = xr.Dataset({name: ((), value, {"long_name": name}) for name, value in numbers.items()})
    table, _ = case_table(case)
    assert [row[:2] for row in table.rows] == [("plateau_mean", "2.0 ± 0.5 (5 of 8)")]
    assert list(ending_lines(case))[-1].startswith("numbers are means over 8 members")


def test_a_unit_stands_behind_its_number_as_people_write_it():
    data = declared(made_up())
    data["peak_friction"].attrs["long_name"] = "largest pressure, in W/(L_x·L_y)"
    data["final_friction"].attrs["units"] = "N m-1"
    table, _ = case_table(one_case(data, {"intrinsic_friction": "0.25"}))
    assert ("peak_friction", "0.2 W/(L_x·L_y)", "largest pressure") in table.rows
    assert ("final_friction", "0.1 N/m", "meaning of final_friction") in table.rows
