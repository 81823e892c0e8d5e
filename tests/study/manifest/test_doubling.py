"""An ensemble that is doubled until it knows enough: its starts at any of its sizes, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from study.manifest.cases import expand
from study.manifest.manifest import Ensemble, Manifest, halving
from study.manifest.problems import ManifestError
from study.manifest.reader import parse_manifest

HEAD = 'title = "x"\nnumerics.n_x = 17\nlimits.events = 60\n'


def manifest(text: str) -> Manifest:
    return parse_manifest(Path("mine.toml"), HEAD + text, {})


def refused(text: str) -> tuple[str, ...]:
    with pytest.raises(ManifestError) as error:
        manifest(text)
    return error.value.lines


@pytest.mark.parametrize("count", [1, 2, 4, 8, 64, 8192])
def test_any_size_that_it_has_is_spread_evenly(count: int) -> None:
    """Exactly: halves have no rounding."""
    assert sorted(halving(number) for number in range(count)) == [number / count for number in range(count)]


def test_members_start_so_from_the_cases_own_start_on() -> None:
    cases = expand(manifest("axes.start = [0.4]\nensemble = {members = 8, uncertainty = 0.01}"))
    starts = [case.case.start for case in cases if case.case]
    expected = (0.4 + np.array([0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875])) % 1.0
    np.testing.assert_allclose(starts, expected, rtol=1e-15)


def test_batches_double_what_is_there() -> None:
    ensemble = Ensemble(32, 0.01)
    assert [ensemble.batch(member) for member in range(32)] == [0] * 4 + [1] * 4 + [2] * 8 + [3] * 16
    assert {Ensemble(32).batch(member) for member in range(32)} == {0}


def test_sixteen_are_the_most_where_the_file_does_not_say() -> None:
    assert manifest("ensemble.uncertainty = 0.01").ensemble == Ensemble(16, 0.01)


@pytest.mark.parametrize("members", ["1", "2", "12", "10000", "4.0", "true"])
def test_members_that_cannot_be_doubled_to_are_refused(members: str) -> None:
    (line,) = refused(f"ensemble = {{members = {members}, uncertainty = 0.01}}")
    assert line.startswith(f"mine.toml: ensemble.members = {members}: needs a ")
    if members.isdigit():
        assert line.endswith("a power of two from 4 to 8192 beside uncertainty, as members are doubled")


@pytest.mark.parametrize("uncertainty", ["0", "1", "-0.1", "1.0", "true", '"1 %"', "nan", "inf", "[0.1]"])
def test_an_uncertainty_is_a_share(uncertainty: str) -> None:
    (line,) = refused(f"ensemble.uncertainty = {uncertainty}")
    assert line.startswith("mine.toml: ensemble.uncertainty = ")
    assert line.endswith(": needs a relative uncertainty, 0 < uncertainty < 1")


def test_both_mistakes_are_said_at_once() -> None:
    assert [line.split(":")[1] for line in refused("ensemble = {members = 5, uncertainty = 2}")] == [
        " ensemble.members = 5",
        " ensemble.uncertainty = 2",
    ]


@pytest.mark.parametrize("observable", ["mean_step", "", "plateau_uncertainty", "μ_s"])
def test_what_an_ensemble_cannot_be_asked_for_is_refused(observable: str) -> None:
    (line,) = refused(f'ensemble = {{uncertainty = 0.01, observable = "{observable}"}}')
    assert line.startswith(f'mine.toml: ensemble.observable = "{observable}"')
    assert line.endswith(": needs one of plateau_mean, static_friction, kinetic_friction")


@pytest.mark.parametrize("value", ["1", "true", '["static_friction"]'])
def test_an_observable_is_a_word(value: str) -> None:
    (line,) = refused(f"ensemble = {{uncertainty = 0.01, observable = {value}}}")
    assert line.startswith("mine.toml: ensemble.observable = ")


def test_an_observable_needs_an_uncertainty() -> None:
    (line,) = refused('ensemble.observable = "static_friction"\n[[drives]]\nname = "a"')
    assert line.endswith(": needs uncertainty = 0.002, or another one, beside it")


def test_without_drives_there_is_no_friction_of_theirs() -> None:
    (line,) = refused('ensemble = {uncertainty = 0.01, observable = "static_friction"}')
    needed = 'stage "dynamics", which a [[drives]] table brings: without it there is no static_friction'
    assert line == f"mine.toml: ensemble.uncertainty = 0.01: needs {needed}"


def test_without_sliding_there_is_no_plateau_to_know() -> None:
    (line,) = refused('stages = ["contact"]\nensemble.uncertainty = 0.01')
    assert line == 'mine.toml: ensemble.uncertainty = 0.01: needs stage "slip": without it there is no plateau_mean'
