"""A trace gives back the friction that it was made with, within its ±; a file that is none is one message."""

import json
import math
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.simulate import drive_result, friction_record
from nanoslip.study.measured.columns import decode_text
from nanoslip.study.measured.means import steady_mean
from nanoslip.study.measured.recording import Trace, TraceOptions, read_trace
from nanoslip.study.measured.trace import TraceNumbers, measure_trace
from tests.conftest import Main

LOAD, MASS = 100.0, 0.5
STATIC, KINETIC, ZETA = 0.31, 0.26, 0.1
LAB = Path("lab.csv")


def within(found: TraceNumbers, name: str, truth: float, times: float = 3.0) -> None:
    """Of Student's t over ten slips or so, 3 ± of 68 % miss once in a hundred traces."""
    number = found.numbers[name]
    assert abs(number.value - truth) <= times * number.uncertainty, f"{name}: {number} instead of {truth}"


def analytic(drive: Drive, samples: int, duration: float) -> tuple[NDArray[np.float64], ...]:
    """Time (s) and force (N) of Eq. 16-19."""
    scales = Scales()
    unit = scales.time(MASS)
    time = np.linspace(0.0, duration, samples)
    load = LOAD / scales.force
    force = stick_slip(time / unit, drive, KINETIC * load, STATIC * load).spring_force
    return time, force * scales.force


SLOW = Drive.from_si(Scales(), MASS, spring_stiffness=2e4, stage_velocity=2e-3, damping_ratio=ZETA, duration=4.0)


def test_a_force_that_is_steady_counts_from_its_first_sample_to_its_last() -> None:
    at = np.linspace(2.0, 12.0, 4001)
    force = 3.0 + 0.1 * np.random.default_rng(1).standard_normal(len(at))
    mean, start, change = steady_mean(at, force, "N")
    assert start == at[0]
    assert mean.value == pytest.approx((force.sum() - (force[0] + force[-1]) / 2) / 4000, rel=1e-12)
    assert math.isnan(change)


def test_the_closed_form_is_read_back() -> None:
    time, force = analytic(SLOW, 20_001, 2.0)
    found = measure_trace(Trace(time, force, "time"), LOAD, velocity=2e-3)
    truth = {
        "static_friction": STATIC,
        "kinetic_friction": KINETIC,
        "rising_stiffness": 2e4,
        "damping_ratio": ZETA,
        "natural_period": 2.0 * math.pi * math.sqrt(MASS / 2e4),
    }
    for name, value in truth.items():  # samples are 1/300 of a slip apart; least squares of noise-free slips do better
        assert found.numbers[name].value == pytest.approx(value, rel=1e-3), name
    assert not found.flags
    shrinks = math.exp(-math.pi * ZETA / math.sqrt(1.0 - ZETA**2))
    amplitude = (STATIC - KINETIC) * (1.0 + shrinks)  # of a stage much slower than the slip: 3 % of it here
    assert found.numbers["spring_force_amplitude"].value == pytest.approx(amplitude, rel=0.03)


@pytest.mark.slow
def test_noise_offset_and_uneven_times_leave_it_within_its_uncertainty() -> None:
    random = np.random.default_rng(0)
    time, force = analytic(SLOW, 40_001, 2.0)
    chosen = np.sort(random.choice(len(time), 10_000, replace=False))
    noisy = force[chosen] + 0.01 * LOAD * (STATIC - KINETIC) * random.standard_normal(len(chosen))
    trace = Trace(time[chosen], noisy, "time")
    for name, truth in (("static_friction", STATIC), ("kinetic_friction", KINETIC), ("damping_ratio", ZETA)):
        within(measure_trace(trace, LOAD), name, truth, 4.0)
    assert measure_trace(trace, LOAD).numbers["static_friction"].uncertainty < 0.01 * (STATIC - KINETIC)
    assert not measure_trace(trace, LOAD).flags
    shifted = Trace(trace.at, trace.force + 3.0 + 2.0 * (trace.at - trace.at[0]), "time")
    flags = {flag.name: flag.facts for flag in measure_trace(shifted, LOAD).flags}
    assert flags["offset"]["begins"].value == pytest.approx(0.03, abs=0.01)
    assert flags["drift"]["rate"].value == pytest.approx(0.02, rel=0.2)
    within(measure_trace(shifted.subtract(3.0, 2.0), LOAD), "static_friction", STATIC, 4.0)


@pytest.mark.slow
def test_the_uncertainty_holds_as_often_as_it_states() -> None:
    """108 traces over damping, noise and sampling: 55 to 81 % are three standard deviations of such a count."""
    truth = {
        "static_friction": STATIC,
        "kinetic_friction": KINETIC,
        "natural_period": 2.0 * math.pi * math.sqrt(MASS / 2e4),
        "rising_stiffness": 2e4,
    }
    held: dict[str, list[bool]] = {name: [] for name in (*truth, "mean_force", "damping_ratio")}
    for number, (zeta, level, count) in enumerate(product((0.02, 0.1, 0.3), (0.003, 0.02, 0.08), (1301, 4001))):
        drive = replace(SLOW, damping_ratio=zeta)
        time, force = analytic(drive, count, 2.0)
        truth |= {
            "damping_ratio": zeta,
            "mean_force": measure_trace(Trace(time, force, "time"), LOAD).numbers["mean_force"].value,
        }
        for seed in range(6):
            noise = np.random.default_rng((number, seed)).standard_normal(count)
            trace = Trace(time, force + level * LOAD * (STATIC - KINETIC) * noise, "time")
            found = measure_trace(trace, LOAD, velocity=2e-3).numbers
            for name, value in truth.items():
                held[name].append(abs(found[name].value - value) <= found[name].uncertainty)
    shares = {name: float(np.mean(each)) for name, each in held.items()}
    assert shares == pytest.approx(dict.fromkeys(held, 0.68), abs=0.135)


@pytest.mark.parametrize("noise", [1 / 12, 1 / 5])
def test_slips_below_the_noise_of_samples_are_seen_in_means_but_a_drop_of_one_sample_tells_no_damping(
    noise: float,
) -> None:
    teeth = np.interp(np.arange(3950) % 200, [0, 199, 200], [0.2, 0.3, 0.2])
    force = teeth + 0.1 * noise * np.random.default_rng(1).standard_normal(len(teeth))
    found = measure_trace(Trace(0.01 * np.arange(len(force)), force, "time"))
    assert found.numbers["stick_slip_period"].value == pytest.approx(2.0, rel=0.02)
    assert "kinetic_friction" not in found.numbers
    assert ("averaged" in found.flagged) == (noise > 1 / 10)


def test_slips_that_are_not_resolved_give_no_number_that_needs_their_damping() -> None:
    """Six samples a slip: the middle of a slip without damping is 237 of its ± above μ_k, so it takes a given damping."""
    trace = Trace(*analytic(SLOW, 601, 2.0), "time")
    found = measure_trace(trace, LOAD)
    assert "kinetic_friction" not in found.numbers
    assert "no_damping" in found.flagged
    given = measure_trace(trace, LOAD, damping=ZETA).numbers
    assert given["kinetic_friction"].value == pytest.approx(KINETIC, rel=1e-3)


def test_displacement_is_time_at_the_velocity_of_the_stage() -> None:
    time, force = analytic(SLOW, 20_001, 2.0)
    over_time = measure_trace(Trace(time, force, "time"), LOAD, 2e-3)
    along = Trace(2e-3 * time, force, "displacement")
    again = measure_trace(along.convert_to_time(2e-3), LOAD, 2e-3)
    lengths = measure_trace(along, LOAD)
    for name, number in over_time.numbers.items():
        assert again.numbers[name].value == pytest.approx(number.value, rel=1e-6), name
    assert lengths.numbers["stick_slip_period"].unit == "m"
    assert lengths.numbers["rising_stiffness"].value == pytest.approx(2e4, rel=1e-3)
    assert measure_trace(along).numbers["rising_stiffness"].unit == "N m-1"  # no load is needed for that
    assert lengths.numbers["static_friction"].value == pytest.approx(STATIC, rel=1e-3)


@cache
def driven(**given: float) -> tuple[Trace, float, float, float, float]:
    """The solver's own drive as a trace: μ_s of all its slips, the plateau that it slides on, its mean force, and K in N/m."""
    case, scales = Case(max_events=100_000, max_presliding=8.0), Scales()
    drive = Drive.from_si(scales, MASS, **given)
    record = friction_record(case)
    found = drive_result(case, drive, record)
    time = found.motion.time * scales.time(MASS)
    trace = Trace(time, found.motion.spring_force * scales.force, "time")
    static = found.coefficients.every_static_friction
    contact = record.initial_stiffness * scales.stiffness
    return trace, float(static.mean()), found.plateau.mean, found.coefficients.kinetic_friction, contact


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_solvers_own_drive_is_read_back(noise: float) -> None:
    trace, static, plateau, mean, contact = driven(
        spring_stiffness=2e4, stage_velocity=4e-4, duration=6.0, samples=20_000
    )
    noisy = trace.force + noise * 1.5 * np.random.default_rng(3).standard_normal(len(trace.at))  # slips fall by 1.5 N
    found = measure_trace(Trace(trace.at, noisy, "time"), LOAD, 4e-4)
    within(found, "static_friction", static)
    within(found, "mean_force", mean)
    assert mean > 1.004 * plateau  # the damper's work
    assert found.numbers["kinetic_friction"].value == pytest.approx(plateau, rel=2e-3)  # each has a ± of 1e-3
    within(found, "rising_stiffness", 1.0 / (1.0 / 2e4 + 1.0 / contact))
    assert found.numbers["kinetic_friction"].of >= 8


def test_a_drive_that_slides_has_the_mean_force_and_its_first_slip() -> None:
    trace, _, _, kinetic, contact = driven()
    found = measure_trace(trace, LOAD, 2e-3)
    assert found.numbers["kinetic_friction"].value == pytest.approx(kinetic, rel=1e-4)  # the mean of other stretches
    assert found.numbers["static_friction"].of == 1
    assert "stick_slip_period" not in found.numbers
    assert found.numbers["rising_stiffness"].value == pytest.approx(1.0 / (1.0 / 2e5 + 1.0 / contact), rel=1e-3)
    assert "slides" in found.flagged


def test_steady_sliding_has_a_kinetic_friction_alone() -> None:
    random = np.random.default_rng(5)
    time = np.linspace(0.0, 10.0, 5_001)
    force = np.minimum(20.0 * time, KINETIC * LOAD) + 0.2 * random.standard_normal(len(time))
    found = measure_trace(Trace(time, force, "time"), LOAD)
    assert found.numbers.keys() == {"kinetic_friction", "rising_rate"}
    within(found, "kinetic_friction", KINETIC)
    assert found.numbers["rising_rate"].value == pytest.approx(20.0, rel=0.02)
    assert "no_stick_slip" in found.flagged


def test_one_cycle_has_no_uncertainty() -> None:
    time, force = analytic(SLOW, 20_001, 2.0)
    slip = int(np.argmax(np.diff(force) < 0.0))
    shown = time < time[slip] + 0.1
    found = measure_trace(Trace(time[shown], force[shown], "time"), LOAD)
    assert math.isnan(found.numbers["static_friction"].uncertainty)
    assert found.numbers["static_friction"].value == pytest.approx(STATIC, rel=2e-3)
    assert "one_cycle" in found.flagged


@pytest.mark.slow
def test_the_period_of_many_cycles_is_that_of_one() -> None:
    time = np.arange(0.0, 100.0, 0.01)
    force = np.interp(time % 1.0, [0.0, 0.95, 1.0], [0.2, 0.3, 0.2])
    period = measure_trace(Trace(time, force, "time")).numbers[
        "stick_slip_period"
    ]  # of cycles that are chosen from all
    assert period.value == pytest.approx(1.0, rel=1e-3)


SPIKE = np.zeros(100)
SPIKE[40] = 1.0
TEETH = np.interp(np.arange(1000) % 100, [0, 95, 100], [0.2, 0.3, 0.2])


def test_steps_of_a_sample_are_no_error() -> None:
    found = measure_trace(Trace(0.01 * np.arange(len(TEETH)), TEETH + 1e12, "time"))
    assert found.numbers["static_friction"].value == pytest.approx(1e12, abs=0.5)
    assert "static_friction" not in measure_trace(Trace(0.01 * np.arange(len(SPIKE)), SPIKE, "time")).numbers


@pytest.mark.parametrize(
    ("at", "force", "load", "said"),
    [
        (1e300, 1.0, math.nan, "time = 0 to 9.99e.302: needs numbers up to 1e.50"),
        (1e-300, 1.0, math.nan, "time = 0 to 9.99e-298: needs"),
        (0.01, 1e300, math.nan, "force = 2e.299 to 3e.299: needs"),
        (0.01, 1.0, 1e-300, "force = 2e.299 to"),
        (0.01, 0.0, math.nan, "force = 0 to 0: needs"),
    ],
)
def test_sizes_that_no_laboratory_measures_are_one_message(at: float, force: float, load: float, said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        measure_trace(Trace(at * np.arange(1000), force * TEETH, "time"), load)


def rows(count: int = 40, force: str = "") -> str:
    return "\n".join(f"{number} {force or number % 5}" for number in range(count))


@pytest.mark.parametrize(
    ("text", "units", "said"),
    [
        ("1\n2\n3\n", ("time", "s", "N"), "needs at least 2 lines of two numbers"),
        (rows(9), ("time", "s", "N"), "number of points = 9: needs at least 16"),
        (rows(force="7"), ("time", "s", "N"), "force = 7 to 7: needs numbers"),
        (rows() + "\n3 1", ("time", "s", "N"), "line 41: time = 3 after 39: needs time that goes on"),
        (rows() + "\n3 1", ("displacement", "um", "N"), "goes one way: one stroke"),
        (
            "a;b;c\n" + "\n".join(f"{n};0;{n % 3}" for n in range(20)),
            ("time", "", ""),
            "1 a, 2 b, 3 c: needs --columns",
        ),
        ("t [ms],F [N]\n" + rows().replace(" ", ","), ("time", "s", "N"), "time = 's': the header has t in ms"),
        (rows(), ("time", "N", "N"), "time = 'N': needs a unit of time"),
        (rows(), ("displacement", "s", "N"), "displacement = 's': needs a unit of length"),
        (rows(), ("time", "s", "kg"), "force = 'kg': needs a unit of force"),
    ],
)
def test_nonsense_is_one_message(text: str, units: tuple[str, str, str], said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        read_trace(LAB, text, TraceOptions(**{units[0]: units[1]}, force=units[2]))


def test_units_signs_and_columns_are_read() -> None:
    text = "t/ms;s;G;F/mN\n" + "\n".join(f"{number};0;1;{-(number % 10) - 1},5" for number in range(40))
    trace = read_trace(LAB, text, TraceOptions("ms", "", "mN", ("1", "F")))
    np.testing.assert_allclose(trace.at, np.arange(40) * 1e-3)
    np.testing.assert_allclose(trace.force, (np.arange(40) % 10 + 1.5) * 1e-3)
    back = read_trace(LAB, "\n".join(f"{-number},{number % 9}" for number in range(40)), TraceOptions("", "um", "1"))
    np.testing.assert_allclose(back.at, np.arange(40) * 1e-6)
    assert back.unit == "1"


@pytest.mark.parametrize("letters", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_letters_of_any_instrument_are_read(letters: str) -> None:
    text = decode_text("Weg in µm\tKraft\n1\t2\n".encode(letters))
    assert text == "Weg in µm\tKraft\n1\t2\n"


@pytest.mark.slow
def test_the_command_prints_draws_and_gives_numbers_to_scripts(main: Main, tmp_path: Path) -> None:
    time, force = analytic(SLOW, 4_001, 2.0)
    file, picture = tmp_path / "lab.csv", tmp_path / "lab.png"
    lines = [f"{1e3 * at:.3f};{1e3 * value:.2f}".replace(".", ",") for at, value in zip(time, force, strict=True)]
    file.write_text("\n".join(["Zeit (ms);Kraft (mN)", *lines]))
    given = ("--time", "ms", "--force", "mN", "--load", "100 N", "--velocity", "2 mm/s")
    code, text, errors = main("trace", file, *given, "-o", picture)
    assert (code, errors) == (0, "")
    assert "semicolons, below 1 line" in text
    assert "N/m" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = json.loads(main("trace", file, *given, "--json")[1])
    assert found["static_friction"]["value"] == pytest.approx(STATIC, rel=1e-3)
    for words, said in (
        (("--load", "3 m"), "--load = '3 m': needs a number"),
        (("--load", "-1"), "--load = '-1': needs a number above 0"),
        (("--load", "nan"), "--load = 'nan': needs a number"),
        (("--offset", "1e300 N"), "lab.csv: force = -1e+300 to -1e+300: needs"),
        (("--damping", "nan"), "nan is not a number"),
        (("--time", "s", "--displacement", "m"), "--time and --displacement exclude each other"),
        (("--force", "s"), "needs a unit of force"),
        (("--from", "1 kg"), "--from = '1 kg': needs a number, or one with a unit as \"1 s\""),
    ):
        code, _, errors = main("trace", file, *words)
        assert code == 2
        assert said in errors
