"""What a digit costs: errors, exponents and times of made-up members whose scatter is given, and the command."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nanoslip.solver import Case, Slab
from nanoslip.study.accuracy.digit import (
    BY_LENGTH,
    BY_MEMBERS,
    LENGTH,
    OBSERVABLES,
    Sample,
    bias,
    cheapest,
    errors_of,
    exponent,
    measure_digit,
    points_of,
    time_for_the_same_error,
)
from nanoslip.study.accuracy.measurement import as_table, measure_another_digit
from nanoslip.study.accuracy.setup import FULL, QUICK, Diagram, default_setup, digit_setups, first_of
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.manifest.reader import load_manifest
from tests.conftest import Main

ROOT = Path(__file__).parents[3]
SCATTER = 0.05
SECONDS = {3.0: 0.5, 4.0: 0.6, 6.0: 0.8, LENGTH: 1.0, 16.0: 2.0, 32.0: 4.0}
SMALL = replace(
    default_setup(),
    case=Case(slab=Slab(n_x=17), max_events=None, max_displacement=3e-3),
    drive=NamedDrive.of("short", duration=0.05),
)


def made_up(seed: int, scatter: dict[float, float] | None = None, bias: float = 0.0) -> dict[float, Sample]:
    """Members with mean 2 and relative scatter SCATTER, or that of their length; shortest records are off by `bias`."""
    rng, samples = np.random.default_rng([41, seed]), {}
    for length in FULL.lengths:
        count = FULL.most_starts if length in (LENGTH, FULL.lengths[-1]) else FULL.fewer_starts
        off = rng.standard_normal((len(OBSERVABLES), count)) * (scatter or {}).get(length, SCATTER)
        values = 2.0 * (1.0 + off + (bias if length == FULL.lengths[0] else 0.0))
        samples[length] = Sample(values, np.full(count, SECONDS[length]))
    return samples


def test_the_error_of_means_is_the_scatter_over_the_root_of_the_members():
    for point in points_of(made_up(1), FULL):
        for found in point.found:
            right = SCATTER / math.sqrt(point.members)
            # A root mean square over g groups scatters by 1/√(2g); thrice that in 36 places is no accident.
            assert found.error == pytest.approx(right, rel=3.5 / math.sqrt(2.0 * point.groups))
            assert found.stated == pytest.approx(right, rel=0.25)  # a median of three is a quarter off
    members = [point for point in points_of(made_up(1), FULL) if point.way == BY_MEMBERS]
    assert [point.members for point in members] == list(FULL.members)
    assert [point.seconds for point in members] == pytest.approx(list(FULL.members))


def test_the_exponent_is_minus_two_within_its_own_error():
    """Over 300 made-up cases: unbiased to a tenth of a standard error, whose size is right within a fifth."""
    found, effort = [], replace(FULL, lengths=FULL.lengths[-1:])
    for seed in range(100):
        points = [point for point in points_of(made_up(seed), effort) if point.way == BY_MEMBERS]
        seconds, groups = (np.array([getattr(each, name) for each in points], float) for name in ("seconds", "groups"))
        for place in range(len(OBSERVABLES)):
            errors = np.array([point.found[place].error for point in points])
            found.append(exponent(seconds, errors, groups))
    power, error = np.array(found).T
    times = (power + 2.0) / error
    assert abs(power.mean() + 2.0) < 0.03
    assert np.sqrt(np.mean(times**2)) == pytest.approx(1.0, rel=0.2)


def test_longer_records_are_cheaper_where_scatter_falls_faster_than_its_square_costs():
    """A quarter of the scatter for four times the seconds: a quarter of the time. Bias costs as well."""
    ratios = []
    for seed in range(30):
        points = {point.length: point for point in points_of(made_up(seed, {32.0: SCATTER / 4}), FULL)}
        ratios.append(time_for_the_same_error(points[32.0], points[LENGTH], 0))
    ratio, error = np.array(ratios).T
    assert ratio.mean() == pytest.approx(4.0 / 16.0, rel=0.1)  # 30 ratios, each known to 0.3
    assert 0.6 < np.std(ratio) / error.mean() < 1.5
    points = {point.length: point for point in points_of(made_up(1, bias=SCATTER), FULL)}
    assert points[3.0].found[0].error == pytest.approx(SCATTER * math.sqrt(1.0 + 1.0 / 8.0), rel=0.2)
    assert time_for_the_same_error(points[3.0], points[LENGTH], 0)[0] > 2.0  # 9 times the square, half the seconds


def test_a_length_is_cheaper_only_beyond_chance_and_without_a_bias_that_stays():
    times = {3.0: (0.5, 0.1), LENGTH: (1.0, 0.0), 32.0: (0.9, 0.1)}
    none = dict.fromkeys(times, (0.0, 0.0))
    assert cheapest(times, none, error=1e-3) == 3.0
    assert cheapest({**times, 3.0: (0.9, 0.1)}, none, error=1e-3) == LENGTH
    for size, spread, right in ((8e-4, 1e-4, 3.0), (-8e-4, 3e-4, LENGTH), (2e-3, 1e-4, LENGTH)):
        assert cheapest(times, {**none, 3.0: (size, spread)}, error=1e-3) == right
    rng = np.random.default_rng(3)
    longest = 2.0 + 0.1 * rng.standard_normal(512)
    found, spread = bias(longest[:256] + 0.02 + 0.01 * rng.standard_normal(256), longest)
    assert spread == pytest.approx(0.005 / 16.0, rel=0.15)  # of pairs: the starts' own scatter is not in it
    assert abs(found - 0.01) < 3.0 * spread


def test_members_without_a_number_count_for_nothing():
    rng = np.random.default_rng(5)
    values = 2.0 + 0.1 * rng.standard_normal(512)
    some = np.where(rng.random(512) < 0.1, np.nan, values)
    assert errors_of(some, some, 8).error == pytest.approx(0.05 / math.sqrt(7.2), rel=0.3)
    for nothing in (np.full(512, np.nan), np.zeros(512)):
        assert math.isnan(errors_of(nothing, nothing, 8).error)
    assert math.isnan(errors_of(np.full(512, 2.0), np.full(512, 2.0), 8).error)  # no scatter, no exponent
    assert all(map(math.isnan, exponent(np.ones(3), np.full(3, np.nan), np.ones(3))))


@pytest.fixture(scope="module")
def sheets() -> tuple[Diagram, Diagram]:
    return measure_digit([SMALL], QUICK)


def test_rows_are_members_at_the_default_length_and_lengths_at_the_default_members(sheets):
    verdicts, rows = sheets
    assert [row["of"] for row in verdicts.rows] == list(OBSERVABLES.values())
    ways = [(row["way"], row["members"], row["length"]) for row in rows.rows]
    assert ways == [
        *((BY_MEMBERS, members, LENGTH) for members in QUICK.members),
        *((BY_LENGTH, 8, length) for length in QUICK.lengths),
    ]
    for sheet in sheets:
        assert {name for row in sheet.rows for name in row} == set(sheet.words)
        assert set(sheet.shown) <= set(sheet.words)
        assert not any(name.endswith("front") for name in (*sheet.variables(), *as_table(sheet).header))
    assert all(row["seconds"] > 0.0 for row in rows.rows)
    # A tenth of the error takes a hundred times the seconds, or less by records of another length.
    assert all(0.0 < row["tenth"] <= 100.0 * row["seconds"] for row in verdicts.rows)


def test_a_drive_that_never_slips_leaves_the_plateau():
    measured = measure_another_digit([replace(SMALL, drive=NamedDrive.of("still", stage_velocity=0.0))], QUICK)
    plateau, static, kinetic = measured.diagrams[0].rows
    assert plateau["mean"] > 0.0
    assert math.isnan(static["mean"])
    assert math.isnan(kinetic["error"])
    assert measured.draw(measured.diagrams).startswith(b"\x89PNG")


def test_a_case_without_a_plateau_is_refused():
    with pytest.raises(ManifestError, match=r"The paper's case: no plateau in 3 records of 8 presliding lengths"):
        measure_digit([replace(SMALL, case=replace(SMALL.case, intrinsic_friction=math.inf))], QUICK)


def test_the_command_writes_dataset_table_and_picture_in_80_columns(
    main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("COLUMNS", "80")
    path = tmp_path / "punch.toml"
    path.write_text(
        'title = "A punch"\n[constants]\npin = "flat_punch"\nhalf_width = 0.2\n[numerics]\nn_x = 17\n[[drives]]\nname = "short"\n'
        "duration = 0.05\n"
    )
    code, said, _ = main("accuracy", path, "--digit", "--quick", "--out", tmp_path / "out")
    assert code == 0
    assert max(len(line) for line in said.splitlines() if not line.startswith("written: ")) <= 80
    assert "One more digit" in said
    with xr.open_dataset(tmp_path / "out" / "digit.nc") as found:
        assert found["verdict_of"].values.tolist() == list(OBSERVABLES.values())
        assert found["digit_seconds"].attrs["units"] == "s"
        assert found.attrs["processor"]
    assert "| case | of | seconds |" in (tmp_path / "out" / "digit.md").read_text("utf-8")
    assert (tmp_path / "out" / "digit.png").read_bytes().startswith(b"\x89PNG")
    code, _, refused = main("accuracy", path, "--digit", "--save", tmp_path / "front.json")
    assert code != 0
    assert "--save: needs a front, which is not measured with --digit" in refused


def test_a_campaign_is_measured_with_its_own_first_case_and_drive(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text('title = "Mine"\n[axes]\nintrinsic_friction = [0.2, 0.4]\n[[drives]]\nname = "own"\n')
    setup = first_of(load_manifest(path))
    assert (setup.title, setup.case.intrinsic_friction, setup.drive.name) == ("Mine", 0.2, "own")


def test_the_committed_table_is_what_the_command_writes_and_obeys_the_law():
    """Of a full run: every exponent is -2 within 3 of its errors, as is every error of eight members what they state."""
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in (ROOT / "study" / "accuracy" / "digit.md").read_text("utf-8").splitlines()
        if line.startswith("|")
    ]
    header, verdicts = rows[0], rows[2 : 2 + len(digit_setups()) * len(OBSERVABLES)]
    times = [f"time {length:g}" for length in FULL.lengths if length != LENGTH]
    assert [name for name in header if name.startswith("time ")] == times
    for row in verdicts:
        cells = dict(zip(header, row, strict=True))
        power, its_error = map(float, cells["exponent"].split(" ± "))
        assert abs(1.0 / power + 0.5) < 3.0 * its_error / power**2, cells  # the slope is what scatters evenly
        error, its_error = map(float, cells["error"].split(" ± "))
        assert abs(error - float(cells["stated"])) < 3.0 * its_error, cells
