"""Nothing is known of a gap in a trace: no recurrence, no stick, no fall, no loop spans one."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.arrays import Floats
from nanoslip.study.measured.events import find_events
from nanoslip.study.measured.recording import Trace, has_turns, read_trace
from nanoslip.study.measured.trace import measure_trace
from tests.conftest import Main
from tests.study.measured.test_trace import LOAD, SLOW, analytic

SAMPLES, DURATION = 6001, 3.0
GAPS = {
    "a period and more": [(0.62, 0.95)],
    "five periods": [(0.4, 1.66)],
    "part of a stick": [(0.72, 0.80)],
    "about a slip": [(0.74, 0.86)],
    "many": [(0.40, 0.45), (0.91, 0.96), (1.82, 1.87)],
    "in the first rise": [(0.02, 0.1)],
}


def gapped(gaps: list[tuple[float, float]], noise: float = 0.01) -> tuple[Trace, Trace]:
    """A trace, and the same without the samples in these gaps."""
    time, force = analytic(SLOW, SAMPLES, DURATION)
    force = force + noise * np.random.default_rng(1).standard_normal(len(time))
    kept = np.ones(len(time), bool)
    for start, end in gaps:
        kept &= (time < start) | (time > end)
    return Trace(time, force, "time"), Trace(time[kept], force[kept], "time")


@pytest.mark.slow
@pytest.mark.parametrize("gaps", GAPS.values(), ids=GAPS)
def test_a_gap_changes_no_number_of_stick_slip_by_more_than_its_uncertainty(gaps: list[tuple[float, float]]) -> None:
    """Three of ± as everywhere here; a trace less periodic than that of a closed form is not expected by it."""
    whole, lacking = (measure_trace(trace, LOAD, velocity=2e-3).numbers for trace in gapped(gaps))
    assert lacking.keys() == whole.keys()
    for name, number in whole.items():
        found = lacking[name]
        assert found.value == pytest.approx(number.value, abs=3.0 * found.uncertainty), name
        # Fewer cycles have a wider ±, by Student's t, too; a period that spans a gap has 30 times and more.
        assert found.uncertainty <= 8.0 * number.uncertainty, name


def test_a_gap_is_a_fact_on_the_answer_and_even_or_random_samples_have_none() -> None:
    whole, lacking = gapped(GAPS["a period and more"])
    (flag,) = (flag for flag in measure_trace(lacking, LOAD).flags if flag.name == "gaps")
    assert flag.facts["count"] == 1
    assert flag.facts["longest"] == (pytest.approx(0.33, abs=2e-3), "s")
    random = np.sort(np.random.default_rng(2).choice(len(whole.at), 1000, replace=False))
    for trace in (whole, Trace(whole.at[random], whole.force[random], "time")):
        assert "gaps" not in measure_trace(trace, LOAD).flagged


@pytest.mark.slow
def test_lost_lines_of_a_file_and_empty_ones_say_the_same(main: Main, tmp_path: Path) -> None:
    time, force = analytic(SLOW, SAMPLES, DURATION)
    rows = [f"{second:.4f},{newtons:.4f}" for second, newtons in zip(time, force, strict=True)]
    first, last = 1300, 1950
    empty = [f"{row.split(',')[0]}," for row in rows[first:last]]
    texts = {
        "lost": [*rows[:first], *rows[last:]],
        "empty": [*rows[:first], *empty, *rows[last:]],
    }
    found = {}
    for name, lines in texts.items():
        (tmp_path / name).write_text("\n".join(["t [s],F [N]", *lines]))
        found[name] = read_trace(tmp_path / name, (tmp_path / name).read_text())
        code, said, _ = main("trace", str(tmp_path / name), "--load", "100 N")
        assert code == 0
        assert "gap" in said
    numbers = [measure_trace(trace, LOAD).numbers for trace in found.values()]
    assert numbers[0] == numbers[1]


def test_a_picture_has_no_line_across_a_gap(main: Main, tmp_path: Path) -> None:
    """Loops recorded at 500 Hz over 8 s, but for 1.2 s: both panels' lines had a chord there."""
    time = np.arange(0.0, 8.0, 2e-3)
    place = 0.5e-3 * np.sin(np.pi * time)
    force = np.tanh(20.0 * np.cos(np.pi * time)) + 1e-3 * np.random.default_rng(1).standard_normal(len(time))
    kept = (time < 3.2) | (time > 4.4)
    rows = np.column_stack([time, place, force])[kept]
    np.savetxt(tmp_path / "lab.csv", rows, header="t [s],x [m],F [N]", comments="", delimiter=",", fmt="%.6e")
    picture = tmp_path / "lab.svg"
    assert main("trace", tmp_path / "lab.csv", "--load", "2 N", "-o", picture)[0] == 0
    lines = [path for path in re.findall(r' d="([^"]*)"', picture.read_text()) if path.count("L") > 500]
    assert [line.count("M") for line in lines] == [2, 2]


def test_teeth_that_no_fit_describes_have_their_own_period_on_both_sides_of_a_gap() -> None:
    teeth = np.interp(np.arange(3950) % 200, [0, 199, 200], [0.2, 0.3, 0.2])
    force = teeth + 1e-3 * np.random.default_rng(1).standard_normal(len(teeth))
    kept = np.ones(len(teeth), bool)
    kept[950:1400] = kept[2310:2460] = False
    trace = Trace(0.01 * np.flatnonzero(kept), force[kept], "time")
    found = measure_trace(trace).numbers
    assert found["stick_slip_period"].value == pytest.approx(2.0, rel=1e-2)  # a sample is half a percent of it
    assert found["spring_force_amplitude"].value == pytest.approx(0.1, rel=0.02)
    assert found["mean_force"].value == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize("gaps", GAPS.values(), ids=GAPS)
def test_no_event_spans_a_gap(gaps: list[tuple[float, float]]) -> None:
    whole, lacking = (find_events(trace) for trace in gapped(gaps, 0.0))
    known = lacking.recurrence[np.isfinite(lacking.recurrence)]
    np.testing.assert_allclose(known, np.median(whole.recurrence[1:]), rtol=0.02)
    np.testing.assert_allclose(lacking.drop, np.median(whole.drop), rtol=0.02)
    rises = lacking.rise[np.isfinite(lacking.rise)]
    np.testing.assert_allclose(rises, np.median(whole.rise), rtol=0.02)
    assert len(lacking.at) >= len(whole.at) - 6


def test_friction_of_steady_sliding_does_not_hang_on_the_two_samples_beside_a_gap() -> None:
    time = np.linspace(0.0, 10.0, 2001)
    force = np.minimum(60.0 * time, 30.0) + 0.5 * np.random.default_rng(3).standard_normal(len(time))
    force[[800, 1501]] += 3.0
    kept = (time <= time[800]) | (time >= time[1501])
    number = measure_trace(Trace(time[kept], force[kept], "time"), LOAD).numbers["kinetic_friction"]
    assert number.value == pytest.approx(0.3, abs=3.0 * number.uncertainty)
    assert number.value == pytest.approx(0.3, abs=2e-3)


def jenkins(position: Floats, stiffness: float = 1e5, slips_at: float = 1.0) -> Floats:
    """Force of a spring in a row with a slider."""
    force = [0.0]
    for step in np.diff(position):
        force.append(min(max(force[-1] + stiffness * float(step), -slips_at), slips_at))
    return np.array(force)


@pytest.mark.slow
@pytest.mark.parametrize(("start", "end"), [(3.1, 3.3), (3.1, 3.9), (2.4, 4.6)])
def test_no_stroke_of_a_loop_spans_a_gap(start: float, end: float) -> None:
    time = np.linspace(0.0, 10.0, 4001)
    position = 5e-5 * np.sin(2.0 * math.pi * time)
    force = jenkins(position)
    kept = (time < start) | (time > end)
    whole = measure_trace(Trace(time, force, "time", position=position)).loops
    lacking = measure_trace(Trace(time[kept], force[kept], "time", position=position[kept])).loops
    assert whole
    assert lacking
    assert len(lacking.strokes) < len(whole.strokes)
    for name, number in whole.numbers.items():
        assert lacking.numbers[name].value == pytest.approx(number.value, rel=2e-3), name


def to_and_fro(position: Floats, time: Floats, kept: Floats) -> str:
    """A file of a stage and a slider's force, less the samples that are not kept."""
    force = jenkins(position, 1e3, 0.5)
    rows = zip(time[kept], position[kept], force[kept], strict=True)
    return "\n".join(
        ["t [s],position [m],F [N]", *(f"{at:.4f},{place:.6f},{newtons:.5f}" for at, place, newtons in rows)]
    )


@pytest.mark.parametrize(("start", "end"), [(3.05, 4.98), (3.05, 4.0), (0.02, 0.99), (0.0, 0.98), (2.0, 4.0)])
def test_a_gap_that_ends_near_a_turn_leaves_the_position_and_the_other_loops(start: float, end: float) -> None:
    """Every second the stage turns: of a stroke the gap leaves few samples, or none."""
    time = np.linspace(0.0, 10.0, 4001)
    position = 5e-3 * np.abs(1.0 - time % 2.0)
    kept = (time <= start) | (time >= end)
    trace = read_trace(Path("stage.csv"), to_and_fro(position, time, kept))
    assert trace.position is not None
    loops = measure_trace(trace).loops
    assert loops
    # A gap of two strokes hides where both neighbours end, too.
    assert len(loops.strokes) >= 5
    assert loops.numbers["mid_stroke_friction"].value == pytest.approx(0.5, rel=2e-3)
    assert loops.numbers["contact_stiffness"].value == pytest.approx(1e3, rel=2e-2)


def test_a_jump_of_readings_ends_the_strokes_beside_it_and_a_stage_that_only_jumps_does_not_turn() -> None:
    time = np.linspace(0.0, 10.0, 4001)
    position = 5e-3 * np.abs(1.0 - time % 2.0)
    readings = np.where(time > 4.3, position + 2e-3, position)
    force = jenkins(position, 1e3, 0.5)
    whole, jumping = (
        measure_trace(Trace(time, force, "time", position=places)).loops for places in (position, readings)
    )
    assert whole
    assert jumping
    assert {(stroke.first, stroke.last) for stroke in jumping.strokes} < {
        (stroke.first, stroke.last) for stroke in whole.strokes
    }
    onward = np.where(time > 5.0, 1e-3 * time - 4e-3, 1e-3 * time)
    assert not has_turns(onward)


@pytest.mark.parametrize(("start", "end", "strokes"), [(2.9, 4.1, 9), (3.3, 3.6, 10), (2.9, 5.1, 8), (2.9, 6.1, 7)])
def test_strokes_of_one_sign_on_both_sides_of_a_gap_are_two_unless_it_lies_within_one(
    start: float, end: float, strokes: int
) -> None:
    """Every second the force changes its sign: a gap that is longer than that has hidden strokes."""
    time = np.linspace(0.0, 10.0, 4001)
    force = jenkins(5e-3 * np.abs(1.0 - time % 2.0), 1e3, 0.5)
    kept = (time <= start) | (time >= end)
    trace = Trace(time[kept], force[kept], "time")
    (flag,) = (flag for flag in measure_trace(trace).flags if flag.name == "strokes")
    assert flag.facts["strokes"] == strokes
