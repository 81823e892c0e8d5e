"""Axes of drives make one drive of each table at each point; what is wrong with them is told like all else."""

import math

import pytest

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.outcome import Ending, InvalidInput
from nanoslip.study.manifest.manifest import NamedDrive, drive_parameters, drive_sizes
from nanoslip.study.manifest.problems import ManifestError
from tests.study.manifest.problems import lines_of
from tests.study.manifest.test_reader import said
from tests.study.plan.running import read

TABLE = '[[drives]]\nname = "a"\n'
STROKE = TABLE + "stage_stroke = 0.002\n"
AXES = "[drive_axes]\nspring_stiffness = [1e5, 200_000]\nstage_velocity = [1e-3, 2e-3, 3e-3]\n"


def test_a_table_is_driven_at_every_point_of_the_axes(tmp_path):
    found = read(tmp_path, AXES + TABLE + "damping_ratio = 0.2\n")
    assert found.stages == ("contact", "slip", "dynamics")
    assert found.drive_axes == {"spring_stiffness": (1e5, 2e5), "stage_velocity": (1e-3, 2e-3, 3e-3)}
    assert [(each.point["spring_stiffness"], each.point["stage_velocity"]) for each in found.drives] == [
        (k, v) for k in (1e5, 2e5) for v in (1e-3, 2e-3, 3e-3)
    ]
    assert found.drives[5].drive == NamedDrive.of("a", spring_stiffness=2e5, stage_velocity=3e-3, damping_ratio=0.2)
    assert found.drives[5].label == "a spring_stiffness=200000.0 stage_velocity=0.003"
    assert len({each.label for each in found.drives}) == 6


def test_axes_alone_are_of_the_default_drive_and_of_several_tables_of_each(tmp_path):
    found = read(tmp_path, AXES)
    assert {each.name for each in found.drives} == {"default"}
    assert found.drives[1].drive == NamedDrive.of("default", spring_stiffness=1e5, stage_velocity=2e-3)
    found = read(tmp_path, AXES + TABLE + TABLE.replace('"a"', '"b"'))
    assert [each.name for each in found.drives] == 6 * ["a"] + 6 * ["b"]
    assert read(tmp_path, TABLE).drives[0].label == "a"


def test_one_table_needs_no_name(tmp_path):
    assert read(tmp_path, "[[drives]]\npin_mass = 2\n").drives[0].drive == NamedDrive.of("default", pin_mass=2.0)


def test_parameters_of_a_drive_have_no_other_word_in_a_file_which_tables_of_drives_would_not_know():
    assert not [name for name, stated in drive_parameters().items() if stated.word]


def test_every_parameter_of_a_drive_can_be_an_axis(tmp_path):
    text = '[drive_axes]\npin_mass = [0.1, 1]\nprofile = ["mean", "linear"]\nreverse_motion = [true, false]\nsamples = [10, 20]\n'
    found = read(tmp_path, text).drives
    assert len(found) == 16
    assert found[-1].settings["pin_mass"] == 1.0
    assert found[-1].settings["samples"] == 20
    assert found[-1].drive == NamedDrive.of("default", pin_mass=1.0, profile="linear", reverse_motion=False, samples=20)


def test_a_combination_that_excludes_itself_is_an_outcome_of_that_point(tmp_path):
    """A time step longer than the drive; a stiffness that is out of range for one of the scales' units."""
    found = read(
        tmp_path,
        '[drive_axes]\ntime_step = [1e-6, 1e-3]\nduration = [1e-4, 1e-2]\n[[drives]]\nname = "a"\nintegrator = "rk4"\n',
    )
    (bad,) = [each for each in found.drives if each.drive is None]
    assert bad.point == {"time_step": 1e-3, "duration": 1e-4}
    assert bad.outcome.ending is Ending.INVALID
    assert "needs 0 < time_step ≤ duration" in bad.outcome.message
    assert bad.settings["duration"] == 1e-4


WRONG = {
    AXES + TABLE + "stage_velocity = 1\n": "drives[0].stage_velocity: is in [drive_axes] too: needs one place",
    "[drive_axes]\nstifness = [1]": "drive_axes.stifness = [1]: unknown; did you mean spring_stiffness?",
    "[drive_axes]\nradius = [1]": "drive_axes.radius = [1]: belongs in [constants] or [axes]",
    '[drive_axes]\nname = ["a"]': '…drive_axes.name = ["a"]: unknown…',
    "[drive_axes]\npin_mass = 1": "drive_axes.pin_mass = 1: needs a list of at least one value",
    "[drive_axes]\npin_mass = []": "drive_axes.pin_mass = []: needs a list of at least one value",
    "[drive_axes]\npin_mass = [1, 0]": "drive_axes.pin_mass[1] = 0: needs 1e-30 ≤ pin_mass ≤ 1e30",
    "[drive_axes]\npin_mass = [1, 1.0]": "drive_axes.pin_mass[1] = 1.0: is there twice: needs each value once",
    "[drive_axes]\npin_mass = [1, 2, 1, 2, 1]": "drive_axes.pin_mass: repeats 1, 2",
    f"[drive_axes]\npin_mass = {10_000 * [3]}": "drive_axes.pin_mass: repeats 3",
    f"[drive_axes]\npin_mass = {2 * [*range(1, 40)]}": (
        "drive_axes.pin_mass: repeats 1, 2, 3, 4, 5, 6, 7, 8, and 31 values more"
    ),
    f'[[drives]]\nname = "{1001 * "x"}"': "…: needs at most 1000 characters…",
    '[drive_axes]\ntime_step = [1e-6, -1]\n[[drives]]\nname = "a"\nintegrator = "rk4"': (
        "drive_axes.time_step[1] = -1: needs 0 < time_step ≤ duration with rk4"
    ),
    '[drive_axes]\nintegrator = ["exact", "euler"]': 'drive_axes.integrator[1] = "euler": needs one of exact, rk4',
    "scales.shear_modulus = 1e-30\n[drive_axes]\nspring_stiffness = [1e-20, 1e30]": (
        "drive_axes.spring_stiffness[1] = 1e+30: needs 1e-30 ≤ spring_stiffness ≤ 0.01 with this pin_mass and these scales"
    ),
    '[drive_axes]\npin_mass = [1, 2]\n[[drives]]\nname = "a"\nintegrator = "rk4"': (
        "drives[0].time_step: missing: needs 0 < time_step ≤ duration with rk4"
    ),
    "[drive_axes]\ntime_step = [1e-6]\npin_mass = [1, 2]": 'drive_axes.time_step = 1e-06: needs integrator = "rk4"',
    TABLE + "duration = 1\nduration_periods = 10": (
        "drives[0].duration_periods = 10.0: needs to be left out beside duration = 1"
    ),
    "[drive_axes]\nduration_periods = [10, 20]\nduration = [1.0]": (
        "drive_axes.duration_periods = 10.0: needs to be left out beside duration = 1.0"
    ),
    TABLE + "duration_periods = 0": "drives[0].duration_periods = 0: needs 1e-30 ≤ duration_periods ≤ 1e30",
    TABLE + "max_slips = 0": "drives[0].max_slips = 0: needs 1 to 2^63 - 1",
    STROKE + "duration = 1": (
        "drives[0].duration = 1: needs to be left out beside stage_stroke = 0.002: stage_cycles end the drive"
    ),
    STROKE
    + "stage_travel = 1e-3": "…drives[0].stage_travel = 0.001: needs to be left out beside stage_stroke = 0.002…",
    STROKE + "max_slips = 3": "drives[0].max_slips = 3: needs to be left out beside stage_stroke",
    STROKE + "stage_velocity = 0": "drives[0].stage_velocity = 0.0: needs stage_velocity > 0 with stage_stroke",
    STROKE + "stage_frequency = 2\nstage_velocity = 1e-3": (
        "drives[0].stage_frequency = 2.0: needs to be left out beside stage_velocity = 0.001"
    ),
    STROKE + 'stage_motion = "square"': 'drives[0].stage_motion = "square": needs one of triangle, sine',
    STROKE + "stage_cycles = 1": "drives[0].stage_cycles = 1: needs 2 to 100000",
    TABLE + "stage_cycles = 8": "drives[0].stage_cycles = 8: needs stage_stroke beside it",
    TABLE + "stage_frequency = 2": "drives[0].stage_frequency = 2: needs stage_stroke beside it",
    TABLE + 'stage_stroke = "2 N"': "…drives[0].stage_stroke…",
}


@pytest.mark.parametrize(("text", "line"), WRONG.items())
def test_a_wrong_axis_is_refused_in_one_line(tmp_path, text, line):
    with pytest.raises(ManifestError) as error:
        read(tmp_path, text)
    (found,) = (each.removeprefix(f"{tmp_path}/mine.toml: ") for each in lines_of(error.value))
    assert said(found, text, line), found


IN_SECONDS = "with this pin_mass and spring_stiffness"  # period of the pin on its spring: 2π√(0.5/2e5) s = 9.93 ms
IN_UNITS = "with this pin_mass and these scales"  # stiffness 1e8 N/m, time √(0.5/1e8) s


@pytest.mark.parametrize(
    ("given", "need"),
    {
        "spring_stiffness = 1e-29": f"1e-22 ≤ spring_stiffness ≤ 1e30 {IN_UNITS}",
        "duration = 1e+30": f"1e-30 ≤ duration ≤ 7.07107e25 {IN_UNITS}",
        "duration_periods = 1e-30": f"1.00658e-28 ≤ duration_periods ≤ 1e30 {IN_SECONDS}",
        "duration_periods = 1e+28": f"1e-30 ≤ duration_periods ≤ 7.11763e27 {IN_UNITS}",
        "stage_travel = 1e+30": "1e-30 ≤ stage_travel ≤ 2e27 with this stage_velocity",
        "stage_travel = 1e+25": f"1e-30 ≤ stage_travel ≤ 1.41421e23 {IN_UNITS}",
    }.items(),
)
def test_what_is_out_of_range_in_other_units_is_refused_in_those_of_its_key(tmp_path, given, need):
    with pytest.raises(ManifestError) as error:
        read(tmp_path, f"{TABLE}{given}\n")
    assert str(error.value).endswith(f"drives[0].{given}: needs {need}")
    key, value = given.split(" = ")
    with pytest.raises(InvalidInput) as raised:
        Drive.from_si(**{key: float(value)})
    assert str(raised.value) == f"{given}: needs {need}"


def test_a_duration_in_periods_is_that_many_of_the_pin_on_its_spring(tmp_path):
    """2π√(m/k), also where mass and stiffness are axes; in the solver's units, where m = 1, 2π/√k."""
    found = read(
        tmp_path, "[drive_axes]\npin_mass = [0.5, 2]\nspring_stiffness = [1e4]\n" + TABLE + "duration_periods = 30\n"
    )
    for each in found.drives:
        assert each.drive is not None
        seconds = 30.0 * 2.0 * math.pi * math.sqrt(each.settings["pin_mass"] / 1e4)  # type: ignore[operator]
        assert each.drive.in_si.duration == pytest.approx(seconds, rel=1e-15)
        assert each.settings["duration"] == each.drive.in_si.duration
        assert each.settings["duration_periods"] == 30.0
        driven = each.drive.dimensionless(Scales())
        assert driven.duration == pytest.approx(30.0 * 2.0 * math.pi / math.sqrt(driven.spring_stiffness), rel=1e-14)
    assert NamedDrive.of("a", duration_periods=3).dimensionless(Scales()) == Drive.from_si(duration_periods=3)
    assert NamedDrive.of("a", stage_travel=4e-4).in_si.duration == 4e-4 / 2e-3
    with pytest.raises(InvalidInput, match=r"stage_velocity = 0\.0: .*stage_travel"):
        NamedDrive.of("a", stage_travel=1, stage_velocity=0)
    with pytest.raises(InvalidInput, match=r"duration_periods = 3: .*duration = 1"):
        Drive.from_si(duration_periods=3, duration=1)


def test_the_sizes_of_a_drive_are_its_numbers_with_a_symbol_and_its_words_are_none():
    chosen = {"integrator": ("exact",), "memory": (True,), "spring_stiffness": (200e3,), "stage_velocity": (1e-3, 2e-3)}
    assert drive_sizes(chosen) == ["k = 200 kN/m", "V_o = 1 to 2 mm/s"]
