"""A value with a unit is the number that it stands for, whoever writes it, and nothing else."""

import math
import re
from pathlib import Path

import pytest

from nanoslip.solver.drive import Scales
from nanoslip.study import api
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import si_line
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.measured.units import factor
from nanoslip.study.plan.plan import make_plan
from tests.study.manifest.problems import lines_of

IN_UNITS = """title = "x"
stages = ["contact", "slip", "dynamics"]
axes = {normal_load = ["100 N", 2e-3, "0.3 kN"]}
constants = {radius = "20 cm", aspect_ratio = "0.5 mm"}
limits = {displacement = "10 um"}
scales = {slab_width = "1 mm", slab_depth = "1 cm", shear_modulus = "10 GPa"}
drives = [{name = "a", spring_stiffness = "200 kN/m", stage_travel = "200 µm", pin_mass = "500 g"}]
drive_axes = {stage_velocity = ["2 mm/s", "0.01 m s-1", 0.02]}
"""
IN_NUMBERS = """title = "x"
stages = ["contact", "slip", "dynamics"]
axes = {normal_load = [1e-3, 2e-3, 3e-3]}
constants = {radius = 200.0, aspect_ratio = 0.5}
limits = {displacement = 0.01}
drives = [{name = "a", spring_stiffness = 2e5, stage_travel = 2e-4, pin_mass = 0.5}]
drive_axes = {stage_velocity = [2e-3, 0.01, 0.02]}
"""


def read(text: str, **beside: str) -> Manifest:
    return parse_manifest(Path("mine.toml"), text, beside)


def test_a_length_asks_for_the_width_that_it_is_over_and_a_load_for_none() -> None:
    """A ball of 5 mm was taken for one on a slab 1 mm wide."""
    for lines in ('constants.radius = "5 mm"', 'axes.radius = [100, "5 mm"]', 'limits.displacement = "10 um"'):
        with pytest.raises(ManifestError, match=r'needs slab_width = "1 mm" .*scales'):
            read(f'title = "x"\n{lines}')
        assert read(f'title = "x"\n{lines}\nscales.slab_width = "10 mm"').path
    assert read('title = "x"\nconstants.normal_load = "100 N"').tables["constants"] == {"normal_load": 1e-3}


BALLS = """title = "x"
scales.young_modulus = "100 MPa"
axes = {normal_load = ["0.3 N", "0.5 N"], radius = ["2 mm", "5 mm"]}
constants = {poisson = 0.49}
numerics = {scheme = "half_space", n_x = 25}
"""


def needed_widths(text: str) -> set[str]:
    """Widths in the messages on lengths without one."""
    with pytest.raises(ManifestError) as refused:
        read(text)
    return set(re.findall(r'slab_width = "([^"]*)"', str(refused.value)))


def test_a_missing_width_is_refused_with_the_one_of_the_largest_contact() -> None:
    """Hertz: a³ = 3WR(1 - ν²)/(4E) for the largest load and radius; the same width then makes the campaign right."""
    half_width = (0.75 * 0.5 * 5e-3 * (1.0 - 0.49**2) / 100e6) ** (1.0 / 3.0)
    (width,) = needed_widths(BALLS)
    number, unit = width.split()
    assert float(number) * factor(unit, "m") == pytest.approx(3.5 * half_width, rel=0.05)
    found = read(f'{BALLS}scales.slab_width = "{width}"')
    assert found.scales.slab_width == pytest.approx(float(number) * factor(unit, "m"))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("half_space", "galerkin"),
        ('"100 MPa"', '"100 s"'),
        ('["0.3 N", "0.5 N"]', "[1e-3, 2e-3]"),
        ('["0.3 N", "0.5 N"]', '["-0.3 N", "-0.5 N"]'),
        ("0.49", "7.0"),
        ('["2 mm", "5 mm"]', '["2 mm", [1.0, 2.0], {a = "5 N"}]'),
        ('scales.young_modulus = "100 MPa"\n', ""),
    ],
)
def test_a_width_that_does_not_follow_is_asked_for_without_a_crash(old: str, new: str) -> None:
    with pytest.raises(ManifestError):
        read(BALLS.replace(old, new))


@pytest.mark.parametrize("unit", ["N/", "N*", "N**", "-", "N)", "(N", '"', "N0", "[N"])
def test_what_is_no_unit_is_refused_by_its_key(unit: str) -> None:
    with pytest.raises(ManifestError) as caught:
        read(f"title = 'x'\nconstants.normal_load = '5 {unit}'")
    assert lines_of(caught.value)[0].startswith("mine.toml: constants.normal_load = ")
    assert math.isnan(factor(unit, "N"))


def test_a_load_per_length_is_that_of_plane_strain_over_the_depth_of_the_slab() -> None:
    per_length = IN_UNITS.replace('"100 N", 2e-3, "0.3 kN"', '"10 N/mm", "2e4 N/m", "30 kN/m"')
    assert read(per_length).axes["normal_load"] == pytest.approx([1e-3, 2e-3, 3e-3], rel=1e-15)


def test_a_campaign_in_units_is_the_same_tasks_to_the_bit() -> None:
    keys = [{task.key for task in make_plan(read(text)).tasks} for text in (IN_UNITS, IN_NUMBERS)]
    assert keys[0] == keys[1]


def test_loads_and_lengths_are_multiples_of_the_campaigns_own_scales() -> None:
    scales = 'title = "x"\nscales = {slab_width = "2 mm", slab_depth = "5 mm"}'
    text = f'{scales}\nconstants = {{normal_load = "50 N", radius = "0.1 m"}}'
    assert read(text).tables["constants"] == {"normal_load": 50.0 / (1e10 * 2e-3 * 5e-3), "radius": 50.0}


def test_cells_of_a_table_have_units_too() -> None:
    given = read(
        'title = "x"\ntable = "t"\nscales.slab_width = 1e-3', table="normal_load,radius\n100 N,20 cm\n0.002,100\n"
    )
    assert given.axes == {"normal_load": (1e-3, 2e-3), "radius": (200.0, 100.0)}


@pytest.mark.parametrize(
    "unit", ["2e5 N/m", "200 kN/m", "200kN/m", "200 kN m-1", "200 N / mm", "0.2 N·µm^-1", "2e8 g/s^2"]
)
def test_a_unit_can_be_spelled_as_people_do(unit: str) -> None:
    (drive,) = read(f'title = "x"\ndrives = [{{name = "a", spring_stiffness = "{unit}"}}]').drives
    assert drive.settings["spring_stiffness"] == 2e5


def test_a_young_modulus_is_a_shear_modulus_with_the_campaigns_poisson() -> None:
    assert read('title = "x"\nscales.young_modulus = "26 GPa"\nconstants.poisson = 0.3').scales == Scales(
        shear_modulus=26e9 / 2.6
    )
    rubber = 'title = "x"\nscales.young_modulus = "3 MPa"\nconstants.poisson = 0.5\nnumerics.scheme = "layer"\n'
    assert read(rubber).scales.shear_modulus == pytest.approx(1e6)
    for poisson, scheme in (("0.5", "galerkin"), ("-1", "layer"), ("true", "layer"), ('"a"', "layer")):
        with pytest.raises(ManifestError) as wrong:
            read(rubber.replace("0.5", poisson).replace("layer", scheme))
        assert [each.key for each in wrong.value.problems] == ["poisson"]
    for beside in ("scales.shear_modulus = 1e10", "axes.poisson = [0.3, 0.4]"):
        with pytest.raises(ManifestError, match="shear_modulus"):
            read(f'title = "x"\nscales.young_modulus = 26e9\n{beside}')


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            'constants.normal_load = "100 Nm"',
            'constants.normal_load = "100 Nm": needs a number, or one with a unit as "100 N"',
        ),
        ('axes.radius = [100, "2 kg"]', r'axes.radius\[1\] = "2 kg": needs a number, or one with a unit as "2 m"'),
        ('constants.radius = "20 ells"', 'constants.radius = "20 ells": needs a number, or one with a unit as "20 m"'),
        ('constants.radius = "wide"', 'constants.radius = "wide": needs a number'),
        ('numerics.n_x = "5 mm"', 'numerics.n_x = "5 mm": needs a whole number'),
        ('constants.normal_load = "1e9 N"', r"constants.normal_load = 10000.0: needs 1e-30 ≤ normal_load ≤ 1.*"),
        ('scales.slab_width = "1 g"', 'scales.slab_width = "1 g": needs a number, or one with a unit as "1 m"'),
        ('drives = [{name = "a", stage_velocity = "2 m"}]', r'drives\[0\].stage_velocity = "2 m": needs .* as "2 m/s"'),
        ('drive_axes.pin_mass = ["1 kg", "1 s"]', r'drive_axes.pin_mass\[1\] = "1 s": needs .* as "1 kg"'),
    ],
)
def test_a_wrong_unit_is_one_line_with_an_example(line: str, said: str) -> None:
    with pytest.raises(ManifestError, match=f"^mine.toml: {said}$") as refused:
        read(f'title = "x"\n{line}')
    assert len(lines_of(refused.value)) == 1


def test_python_takes_units_and_a_line_says_all_in_si() -> None:
    small = {
        "constants": {"normal_load": "100 N"},
        "numerics": {"n_x": 17},
        "limits": {"events": 3},
        "ensemble": {"members": 1},
    }
    assert api.run({"title": "x", **small}, progress=False)["normal_load"].item() == 1e-3
    line = si_line(Scales(slab_width=2e-3), {"n_x": 129}, {"normal_load": (1e-3, 2e-3)})
    sizes = "L_x = 2 mm, R = 400 mm, W = 200 to 400 N, L_z = 2 mm, L_y = 10 mm, G = 10 GPa, E = 26.67 GPa"
    assert line == f"{sizes}, nodes 15.62 μm apart"
