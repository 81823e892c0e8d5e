"""Files of instruments are read by the names and units of their columns, or refused with the text that was met."""

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.measured.columns import decode_text, read_columns
from nanoslip.study.measured.means import REJECTED, VALUE_BATCHES, has_correlation, independent
from nanoslip.study.measured.recording import Trace, TraceOptions, is_two_way, limits, outliers, read_trace
from nanoslip.study.measured.trace import TraceNumbers, measure_trace
from tests.conftest import Main

Floats = NDArray[np.float64]
LAB = Path("lab.txt")
STATIC, KINETIC, RISE, PERIOD = 29.43, 19.62, 40.0, 0.6677


def stick_slip(seconds: float = 8.0, apart: float = 0.01) -> tuple[Floats, Floats]:
    """Eq. 16-19 without damping: the force rises by 40 N/s to 29.43 N, and swings about 19.62 N with a period of 0.314 s."""
    time, omega = np.arange(0.0, seconds, apart), 20.0
    reach, first = RISE / omega, STATIC / RISE
    swing = STATIC - KINETIC
    slip = 2.0 * (np.pi - np.arctan(swing / reach)) / omega
    cycle = slip + 2.0 * swing / RISE
    phase = (time - first) % cycle
    sliding = KINETIC + swing * np.cos(omega * phase) + reach * np.sin(omega * phase)
    later = np.where(phase < slip, sliding, STATIC + RISE * (phase - cycle))
    return time, np.where(time < first, RISE * time, later)


TIME, FORCE = stick_slip()
COUNT = np.arange(len(TIME))


def table(*columns: Floats | list[str], header: str = "t_s,F_N", separator: str = ",", footer: str = "") -> str:
    lines = [
        separator.join(f"{cell:.6g}" if not isinstance(cell, str) else cell for cell in row)
        for row in zip(*columns, strict=True)
    ]
    return "\n".join([header, *lines, footer])


def numbers(text: str, given: TraceOptions = TraceOptions()) -> TraceNumbers:  # noqa: B008  frozen
    return measure_trace(read_trace(LAB, text, given).divide_by_load())


HOLES = [
    ["Bad", "--", "NaN", ""][place // 40 % 4] if place % 40 == 7 else f"{each:.4f}" for place, each in enumerate(FORCE)
]
FORTRAN = [f"{each:.4e}".replace("e", "D") for each in FORCE]
NEWTONS = {
    "names and units": table(TIME, 2.0 * TIME, FORCE, header="time [s],position [mm],friction force [N]"),
    "index": table(COUNT, TIME, FORCE, header=",t_s,F_N"),
    "index of R": table(COUNT + 1.0, TIME, FORCE, header='"t" "F"', separator=" "),
    "units below names": table(TIME, FORCE, header="time,force\ns,N"),
    "tester": table(TIME, 2.0 * TIME, FORCE, header='"Time","Extension","Load"\n"(s)","(mm)","(N)"'),
    "LabVIEW": table(COUNT, TIME, FORCE, header="***End***\t\n\nX_Value\tTime (s)\tForce (N)\tComment", separator="\t"),
    "letters of Windows": decode_text(
        table(TIME, 0.01 * FORCE, FORCE, header="t [s];µ;Reibkraft in N", separator=";").encode("cp1252")
    ),
    "decimal commas": table(TIME, FORCE, header="Zeit in s;Kraft in N", separator=";").replace(".", ","),
    "prefixes": table(1e3 * TIME, 1e3 * FORCE, header="t/ms,F/mN"),
    "Fortran": table(TIME, FORTRAN, header="# time force", separator="  "),
    "holes": table(TIME, HOLES),
    "footer": table(TIME, FORCE, footer="[End]\nRa 0.041 um"),
    "text between": table(TIME, FORCE).replace("\n4,", "\noverload\n# a remark\n4,"),
    "dates": table(["2026-01-01"] * len(TIME), TIME, FORCE, header="date,time [s],force [N]"),
    "rounded times": table(np.floor(50.0 * TIME) / 50.0, FORCE),
    "a count above": table(TIME, FORCE, header=f"t,F\n{len(TIME)},0.01"),
    "other sign": table(TIME, -FORCE),
}


@pytest.mark.slow
@pytest.mark.everyday(6)
@pytest.mark.parametrize("kind", NEWTONS)
def test_the_force_is_found_by_names_and_units(kind: str) -> None:
    trace = read_trace(LAB, NEWTONS[kind])
    assert (trace.over, trace.unit, trace.load) == ("time", "N", None)
    expected = np.interp(trace.at, TIME, FORCE)
    off = 0.82 if kind == "rounded times" else 0.02  # restored but for half of the 0.02 s, at 40 N/s and twice that
    np.testing.assert_allclose(trace.force[1:70], expected[1:70], atol=off)
    found = measure_trace(trace).numbers
    assert found["static_friction"].value == pytest.approx(STATIC, rel=2e-3)
    assert found["kinetic_friction"].value == pytest.approx(KINETIC, rel=2e-3)
    assert found["stick_slip_period"].value == pytest.approx(PERIOD, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "header", ["t [s],friction [N],normal load [N]", "t(s),Fx(N),Fz(N)", "time [s],F_T [N],F_N [N]"]
)
def test_a_load_column_divides(header: str) -> None:
    load = 100.0 * (1.0 + 0.1 * np.sin(TIME))
    for columns in ((TIME, FORCE * load / 100.0, load), (TIME, FORCE * load / 100.0, -load)):
        found = numbers(table(*columns, header=header)).numbers["static_friction"]
        assert (found.value, found.unit) == (pytest.approx(STATIC / 100.0, rel=2e-3), "1")


MANY = " " * 50_000


@pytest.mark.parametrize(
    "text",
    [
        "x;y\n1;2\n3" + MANY + "q;4\n5;6\n",
        "x,y\n1,2\n3" + MANY + ",4\n5,6\n",
        "x\ty\n1\t2\n3" + MANY + "\t4\n5\t6\n",
        "x y\n1 2\n3" + MANY + "4\n5 6\n",
        "x [m]" + MANY + "y [N]" + MANY + "\n1 2\n3 4\n",
        "x" + MANY + "(m" + MANY + ")\ty" + MANY + "in" + MANY + "N\n1\t2\n3\t4\n",
    ],
    ids=["semicolons", "commas", "tabs", "spaces", "brackets", "units"],
)
def test_runs_of_spaces_are_passed_once(text: str) -> None:
    """A run that is looked through from each of its spaces takes four seconds; once, a hundredth of one."""
    began = time.process_time()
    read_columns(LAB, text)
    assert time.process_time() - began < 1.0


def test_what_is_left_out_is_counted() -> None:
    holes = read_trace(LAB, NEWTONS["holes"]).source
    rounded = read_trace(LAB, NEWTONS["rounded times"]).source
    between = read_columns(LAB, NEWTONS["text between"])
    assert holes
    assert rounded
    assert (holes.holes, rounded.rows.restored, rounded.rows.merged) == (20, 400, 0)
    assert between.left_out == (1, 402, "overload")
    footer = read_columns(LAB, NEWTONS["footer"])
    assert (footer.skipped, footer.below) == (1, 2)
    uneven = np.repeat(np.arange(20.0) ** 2, 2)
    again = read_trace(LAB, table(uneven, np.arange(40.0) % 7)).source
    assert again
    assert again.rows.merged == 20


@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        (table(TIME, FORCE, header="t [s],F [V]"), TraceOptions(), "force = 'V': needs a unit of force"),
        (table(TIME, FORCE, header="t [s],F [mn]"), TraceOptions(), "force = 'mn': needs a unit of force"),
        (table(TIME, FORCE, header="t [s],F [N/m]"), TraceOptions(), "force = 'N/m': needs a unit of force"),
        (table(TIME, FORCE, header="Time,Force\ns,V"), TraceOptions(), "force = 'V': needs a unit of force"),
        (table(TIME, FORCE, FORCE, header="t [s],Force [V],Load [N]"), TraceOptions(), "needs --columns"),
        (table(TIME, FORCE, FORCE, header="a,b,c"), TraceOptions(), "columns 1 a, 2 b, 3 c: needs --columns"),
        (table(TIME, FORCE, header="t [ms],F [N]"), TraceOptions(time="s"), "time = 's': the header has t in ms"),
        (
            table(TIME, FORCE, header="t,F").replace(".", ","),
            TraceOptions(),
            "2 names above 4 columns: are there decimal commas",
        ),
        (
            table(TIME, FORCE, header="") + table(TIME, FORCE, header=""),
            TraceOptions(),
            "line 803: time = 0 after 7.99",
        ),
        (table([f"12:00:{each:05.2f}" for each in TIME], FORCE), TraceOptions(), "is '12:00:"),
        (table(TIME, 1e299 * FORCE, header="t [s],F [N]"), TraceOptions(), r"F = \S+: needs numbers up to 1e\+50"),
        (table(TIME, FORCE, header="t,F"), TraceOptions(columns=("t", "G")), "column = 'G': needs one of 1 t, 2 F"),
        (table(TIME, ["1", "Bad", "Bad", "Bad"] * 200), TraceOptions(), "numbers in 200 of 797 lines"),
    ],
)
def test_what_is_not_read_is_named(text: str, given: TraceOptions, said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        numbers(text, given)


def test_samples_far_from_their_neighbours_are_left_out_and_no_others() -> None:
    random, spiky = np.random.default_rng(0), FORCE.copy()
    assert not outliers(FORCE + 0.1 * random.standard_normal(len(FORCE))).any()
    assert not outliers(random.standard_normal(100_000)).any()
    places = [100, 103, 250, 401, 402, 600, 700]  # 250 and 401 are within slips
    spiky[places] = 0.0
    np.testing.assert_array_equal(np.flatnonzero(outliers(spiky)), places)
    found = numbers(table(TIME, spiky)).numbers["kinetic_friction"]
    assert found.value == pytest.approx(KINETIC, rel=2e-3)


@pytest.mark.slow
def test_numbers_lie_within_the_measured_forces() -> None:
    """Of random walks, sines, creeping slips and teeth as of stick-slip."""
    random = np.random.default_rng(1)
    time = 0.01 * np.arange(2000)
    shapes = {
        "walk": 20.0 + np.cumsum(0.1 * random.standard_normal(2000)),
        "sine": 10.0 + np.sin(3.0 * time),
        "creep": np.interp(time % 5.0, [0.0, 3.0, 5.0], [10.0, 20.0, 10.0]),
        "teeth": 10.0 + 2.0 * (time % 5.0),
        "noise": random.standard_normal(2000),
        "clipped": np.maximum(stick_slip(20.0)[1], 14.0),
    }
    for name, force in shapes.items():
        found = measure_trace(Trace(time, force + 0.01 * random.standard_normal(2000) * (name != "clipped"), "time"))
        for key in ("static_friction", "kinetic_friction", "mean_force"):
            value = found.numbers[key].value if key in found.numbers else force.mean()
            assert force.min() - 0.1 <= value <= force.max() + 0.1, (name, key)
        if {"static_friction", "kinetic_friction"} <= found.numbers.keys():
            assert found.numbers["kinetic_friction"].value <= found.numbers["static_friction"].value
        assert found.numbers["damping_ratio"].value >= 0.0 if "damping_ratio" in found.numbers else True
        assert found.flags, name


def test_forces_of_both_signs_are_strokes() -> None:
    time = np.arange(0.0, 50.0, 0.05)
    square = np.clip(np.abs((time + 2.5) % 10.0 - 5.0) * 0.4 - 1.0, -0.3, 0.3)
    force = 0.05 + square + 0.003 * np.random.default_rng(2).standard_normal(len(time))
    found = measure_trace(Trace(time, force, "time"))
    kinetic, offset = found.numbers["kinetic_friction"], found.numbers["force_offset"]
    assert abs(kinetic.value - 0.3) < 4.0 * kinetic.uncertainty < 0.003
    assert abs(offset.value - 0.05) < 4.0 * offset.uncertainty < 0.003
    assert kinetic.of >= 9
    assert found.flagged[0] == "strokes"
    there_and_back = np.concatenate([FORCE, -FORCE, FORCE, -FORCE])
    slips = measure_trace(Trace(0.01 * np.arange(len(there_and_back)), there_and_back + 1.0, "time")).numbers
    assert slips["static_friction"].value == pytest.approx(STATIC, rel=5e-3)
    assert slips["force_offset"].value == pytest.approx(1.0, abs=0.1)
    assert not is_two_way(FORCE)
    assert not is_two_way(np.random.default_rng(3).standard_normal(1000))


@pytest.mark.parametrize("level", [0.0, 25.0])
def test_a_level_that_never_rises_again_is_the_end_of_the_pull(level: float) -> None:
    noise = 0.05 * np.random.default_rng(4).standard_normal(len(FORCE) + 400)
    force = np.concatenate([FORCE, np.full(400, level)]) + noise
    found = measure_trace(Trace(0.01 * np.arange(len(force)), force, "time"))
    assert "pull_ends" in found.flagged
    assert found.numbers["static_friction"].of >= 10
    assert found.numbers["kinetic_friction"].value == pytest.approx(KINETIC, rel=5e-3)


def test_a_step_between_two_levels_is_no_slip() -> None:
    time = np.arange(0.0, 24.0, 0.02)
    force = np.where(time < 12.0, np.minimum(4.0 * time, 20.0), 10.0)
    found = measure_trace(Trace(time, force + 0.1 * np.random.default_rng(5).standard_normal(len(time)), "time"))
    assert found.flagged == ("pull_ends", "noise", "no_stick_slip")
    assert found.numbers["kinetic_friction"].value == pytest.approx(20.0, abs=0.05)
    assert "static_friction" not in found.numbers


@pytest.mark.slow
def test_numbers_beyond_a_sensor_s_limit_are_missing() -> None:
    low, high = (measure_trace(Trace(TIME, np.clip(FORCE, *ends), "time")) for ends in ((14.0, 99.0), (-1.0, 25.0)))
    assert low.numbers.keys() == {"static_friction", "stick_slip_period"}
    assert FORCE.max() - 0.1 < low.numbers["static_friction"].value <= FORCE.max()
    assert high.numbers.keys() == {"stick_slip_period"}
    assert (low.flagged, high.flagged) == (("sensor_limit",), ("sensor_limit",))
    assert limits(np.round(FORCE, 1)) == (0, 0)


def test_a_largest_force_between_samples_has_no_uncertainty() -> None:
    """Five samples a period look as noise does, but for their period."""
    for samples, flag in ((5.0, "undersampled"), (5.3, "undersampled"), (7.0, "few_samples")):
        time, force = stick_slip(40.0, PERIOD / samples)
        found = measure_trace(Trace(time, force, "time"))
        assert flag in found.flagged
        assert "kinetic_friction" not in found.numbers
        if "static_friction" in found.numbers:
            assert np.isnan(found.numbers["static_friction"].uncertainty)


def test_a_part_of_a_file_is_measured(main: Main, tmp_path: Path) -> None:
    (tmp_path / "lab.csv").write_text(table(TIME + 5.0, FORCE))
    found = json.loads(main("trace", tmp_path / "lab.csv", "--from", "6 s", "--to", "11", "--json")[1])
    assert found["static_friction"]["of"] == 7
    assert found["static_friction"]["value"] == pytest.approx(STATIC, rel=5e-3)
    code, _, errors = main("trace", tmp_path / "lab.csv", "--from", "99")
    assert (code, "number of points = 0" in errors) == (2, True)


def wandering(seed: int, count: int) -> Floats:
    """Values of unit variance whose correlation falls to 1/e over six."""
    random, found = np.random.default_rng(seed), [0.0]
    for shock in random.standard_normal(count + 100):
        found.append(found[-1] * math.exp(-1.0 / 6.0) + shock * math.sqrt(1.0 - math.exp(-1.0 / 3.0)))
    return np.array(found[-count:])


def test_the_uncertainty_holds_where_friction_wanders_over_several_cycles() -> None:
    """2 ± of the scatter of 60 values alone hold in 41 %, of batches in 84 %."""
    rows = [wandering(seed, 60) for seed in range(500)]
    held = [abs(row.mean()) <= 2.0 * mean_of(independent(row)).uncertainty for row in rows]
    alone = [abs(row.mean()) <= 2.0 * mean_of(row).uncertainty for row in rows]
    assert np.mean(held) > 0.77
    assert np.mean(alone) < 0.5


def test_a_trace_whose_friction_wanders_has_a_wider_uncertainty() -> None:
    peaks, ends = 30.0 + 0.3 * wandering(0, 40), np.arange(40) + 0.95
    time = np.arange(0.0, 40.0, 0.02)
    force = np.interp(time, np.sort([*ends, *(ends + 0.05)]), np.ravel([peaks, peaks - 10.0], "F"))
    found = measure_trace(Trace(time, force, "time"), damping=0.1)
    assert "correlated" in found.flagged
    assert abs(found.numbers["static_friction"].value - peaks.mean()) < 0.3
    assert found.numbers["static_friction"].uncertainty > 1.5 * peaks.std() / math.sqrt(40.0)


def test_batches_are_of_correlated_values_alone() -> None:
    random = np.random.default_rng(6)
    white = random.standard_normal((400, 40))
    assert np.mean([has_correlation(row) for row in white]) == pytest.approx(
        REJECTED, abs=0.045
    )  # three deviations of 400
    assert np.mean([has_correlation(wandering(seed, 40)) for seed in range(100)]) > 0.95
    assert len(independent(wandering(0, 40))) == VALUE_BATCHES
