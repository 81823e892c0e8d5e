"""Every number of a result is a variable, in the unit and with the uncertainty that it names."""

import numpy as np

from nanoslip.study.dataset.file import flattened
from nanoslip.study.dataset.variables import all_groups, scalars
from tests.study.dataset.campaigns import CASE_DIMS


def test_each_scalar_is_its_tasks_in_the_units_it_names(small):
    plan, store, found = small
    stiffness, length = plan.manifest.scales.stiffness, plan.manifest.scales.slab_width
    for case in plan.cases:
        keys = plan.case_tasks[case.case_id]
        record = {name: value for name, (value,) in store.read(keys.record).scalars.items()}
        here = found.sel({name: case.parameters[name] for name in CASE_DIMS})
        assert here["case_id"].item() == case.case_id
        assert here["plateau_mean"].item() == record["plateau_mean"]
        assert here["events"].item() == 200
        assert here["plateau_ratio"].item() == record["plateau_mean"] * (1.0 / case.parameters["intrinsic_friction"])
        assert here["initial_friction"].item() == record["initial_force"] * (1.0 / record["normal_load"])
        assert here["surface_stiffness_si"].item() == record["surface_stiffness"] * stiffness
        assert here["mean_step_si"].item() == record["mean_step"] * length
        for name, key in keys.drives.items():
            driven = {name: value for name, (value,) in store.read(key).scalars.items()}
            for scalar in ("static_friction", "macroscopic_slips"):  # NaN where the pin never slipped
                np.testing.assert_equal(here[scalar].sel(drive=name).item(), driven[scalar])
        assert here["outcome"].item() == "completed"


def test_the_variables_that_were_promised_are_there(small):
    promised = (
        "plateau_mean plateau_std plateau_mean_uncertainty plateau_mean_members members drive_members "
        "peak_friction surface_stiffness static_friction kinetic_friction "
        "static_friction_uncertainty kinetic_friction_uncertainty events slips releases touches mean_step outcome message"
    )
    assert set(promised.split()) <= set(small[2].data_vars)


def test_no_number_of_a_result_is_lost(small):
    plan, store, _ = small
    for task in plan.tasks:
        result = store.read(task.key)
        series = [each for group in all_groups().values() for each in group.series if each.kind == task.kind]
        columns = {name for each in series for name in each.columns}
        known_apart = {
            "normal_load",
            "spacing",
            "presliding_length",
            "displacement",
            "spring_force_range",
            *(f"plateau_{name}" for name in ("first_event", "last_event", "peak")),
        }  # of parameters; zero at initial contact; spring_force_amplitude where it means something; for drives over the record
        assert set(result.scalars) - known_apart <= set(scalars(task.kind))
        if task.kind in ("record", "drive"):
            assert set(result.arrays) - {"binned_force"} <= columns  # what uncertainties are made of


def test_every_variable_says_what_it_is_in_which_unit(small):
    _, _, found = small
    for name, variable in flattened(found).items():
        assert variable.attrs["long_name"], name
        assert ("units" in variable.attrs) == (variable.dtype.kind not in "OUTb"), name  # words and switches have none


def test_what_has_an_uncertainty_names_it_and_has_it(small):
    _, _, found = small
    named = {name: variable.attrs.get("ancillary_variables") for name, variable in found.data_vars.items()}
    named = {name: other for name, other in named.items() if other}
    assert {"plateau_mean", "mean_step", "mean_drop", "surface_stiffness", "static_friction"} <= set(named)
    for name, other in named.items():
        for beside in other.split():
            assert set(found[beside].dims) <= set(found[name].dims)
