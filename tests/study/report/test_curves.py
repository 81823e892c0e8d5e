"""The lines of one case: its record's teeth, the spring force of a single drive, its pressure where it has no record."""

import numpy as np
import pytest
import xarray as xr

import nanoslip
from nanoslip.study.dataset.access import one_case
from nanoslip.study.report.curves import curves
from tests.study.report.test_page import made_up

CONTACT = {"title": "One contact", "stages": ["contact"], "numerics": {"n_x": 17}}


def test_a_case_with_one_drive_has_its_teeth_and_its_spring_force():
    data = made_up()
    data["friction_force"] = ((), 0.0)
    for group, name in (("record", "displacement"), ("trajectory", "time"), ("trajectory", "sample_spring_force")):
        data.encoding["nanoslip_groups"][group][name].attrs["long_name"] = name
    found = list(curves(one_case(data, {"intrinsic_friction": "0.25"})))
    assert [curve.x.tolist() for curve in found] == [[0.0, 0.1, 0.1, 0.3, 0.3, 0.4], [0.0, 0.1]]
    assert [curve.y_label for curve in found] == ["friction force over load, F/W", "sample_spring_force"]


def test_a_case_that_failed_or_has_several_drives_has_fewer():
    assert list(curves(one_case(made_up(outcome="contact_lost"), {"intrinsic_friction": "0.5"}))) == []


@pytest.fixture(scope="module")
def contact() -> xr.Dataset:
    return nanoslip.run(CONTACT)


def test_a_contact_is_its_pressure_over_x(contact):
    (found,) = curves(one_case(contact, {}))
    assert found.x.tolist() == np.linspace(-0.5, 0.5, 17).tolist()
    # all forces of the nodes together are the load: trapezia, as pressure is zero at both ends
    assert np.isclose(np.trapezoid(found.y, found.x), 1.0, rtol=1e-9)
    assert found.x_label == "x from the slab's middle, in L_x, x/L_x"
