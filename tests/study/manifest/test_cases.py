"""Axes become cases; a case is named by its content and by nothing else."""

import itertools
import math
from typing import Any

import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.canonical import content_hash
from nanoslip.study.manifest.cases import expand, naming
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import LIMITS, TABLES, make_case, names_by_word, table_words
from nanoslip.study.manifest.problems import ManifestError
from tests.study.plan.running import read

RECORDED = ["0d87c6b70f5a", "6e043805bebd", "e3adee2311d8", "347274bebc47"]


def ids(manifest: Manifest) -> set[str]:
    return {case.case_id for case in expand(manifest)}


def alone(parameters: dict[str, Any]) -> Case | str:
    """The case with these parameters, or why there is none."""
    try:
        return make_case(parameters)
    except InvalidInput as error:
        return error.outcome.message


def test_no_axes_are_one_case(tmp_path):
    assert [case.case for case in expand(read(tmp_path, "constants.radius = 50"))] == [Case(radius=50, **LIMITS)]


def test_cases_that_are_the_same_are_named_by_the_words_of_the_manifest(tmp_path):
    manifest = read(tmp_path, 'design = "zip"\naxes.events = [5, 5]\naxes.radius = [50, 50]')
    with pytest.raises(ManifestError, match=r"cases 1 and 2: .*radius = 50, .*, events = 5$") as error:
        expand(manifest)
    assert str(error.value).startswith(f"{tmp_path}/mine.toml: cases")


def test_repeated_values_of_an_axis_are_one_problem(tmp_path):
    """As they are written, before any is converted, or in another unit."""
    for radii in ("[50, 60, 50, 70, 70]", '[50, "50 mm"]', "[50, 50.0]", f"{10_000 * [50]}"):
        with pytest.raises(ManifestError) as error:
            expand(read(tmp_path, f'axes.radius = {radii}\naxes.events = [5, 6]\nscales.slab_width = "1 mm"'))
        assert [(each.place.part, each.key) for each in error.value.problems] == [("axes", "radius")]


def test_labels_are_the_standard_four_and_the_axes(tmp_path):
    (case,) = expand(read(tmp_path, 'axes.normal_load = [1e-3]\naxes.pin = ["flat_punch"]\nconstants.poisson = 0.25'))
    assert case.parameters == {
        "intrinsic_friction": 0.5, "radius": 200.0, "aspect_ratio": 1.0, "n_x": 129, "normal_load": 1e-3, "pin": "flat_punch"
    }  # fmt: skip


def test_the_name_knows_content_only(tmp_path):
    """Neither the order of axes, nor what is an axis, a default or an int, nor titles, scales and drives matter."""
    first = ids(read(tmp_path, "axes.radius = [50, 200]\naxes.n_x = [17, 33]"))
    drive = '[[drives]]\nname = "other"\n[scales]\nslab_width = 1.0\n'
    second = ids(
        read(tmp_path, f"axes.n_x = [33, 17]\naxes.radius = [200.0, 5e1]\nconstants.normal_load = 1e-3\n{drive}")
    )
    assert len(first) == 4
    assert first == second


@pytest.mark.parametrize(
    "text",
    [
        "axes.radius = [50, 60]\naxes.aspect_ratio = [1, 2]\naxes.events = [5, 6]",
        "axes.intrinsic_friction = [0.5, inf]\naxes.residual_shear = [0, 1]\naxes.spread = [0, 0.1]",
        "axes.radius = [50, 60]\naxes.n_x = [17, 33]\nnumerics = {rows = 6, scheme = 'biquadratic'}",
        "axes.start_y = [0, 0.25, 0.5]\nnumerics.scheme = 'half_space'",
        "axes.spacings = [1, 2]\naxes.pin = ['parabola', 'flat_punch']\nlimits.displacement = 0.1",
    ],
)
def test_each_case_is_what_its_parameters_make_alone(tmp_path, text):
    """Cases share what they have in common; nothing of one is in another."""
    manifest = read(tmp_path, text)
    cases = expand(manifest)
    assert len(cases) == math.prod(map(len, manifest.axes.values()))
    for case, values in zip(cases, itertools.product(*manifest.axes.values()), strict=True):
        given = {**manifest.fixed, **dict(zip(manifest.axes, values, strict=True))}
        assert (case.case or case.outcome.message) == alone(given)
        if case.case is not None:
            assert case.case_id == content_hash("case", naming(case.case.flat), length=12)
        assert all(case.parameters[name] == given[name] for name in manifest.axes)


def test_the_names_of_cases_are_what_they_were(tmp_path):
    """They are coordinates of datasets that are there."""
    text = "numerics.n_x = 17\naxes.radius = [50, 60.5]\naxes.spread = [0, 0.1]\nensemble.members = 2"
    text += "\nlimits.events = 100000\nlimits.presliding = 8"
    assert [case.case_id for case in expand(read(tmp_path, text))] == RECORDED


def test_a_displacement_limit_stands_alone_unless_events_are_given(tmp_path):
    (alone,) = expand(read(tmp_path, "limits.displacement = 1e-3"))
    (both,) = expand(read(tmp_path, "limits.displacement = 1e-3\nlimits.events = 7"))
    limits = [(case.case.max_events, case.case.max_displacement) for case in (alone, both) if case.case]
    assert limits == [(None, 1e-3), (7, 1e-3)]


def test_every_field_of_a_case_is_a_parameter():
    """A parameter without a table of a manifest would be out of reach."""
    reached = [names_by_word()[word] for table in TABLES for word in table_words(table)]
    assert sorted(reached) == sorted(Case().flat)
