"""`trace --over` of a recording with loops: a recording made of computed loops has their numbers, and both are drawn."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from nanoslip.study import api
from nanoslip.study.commands.computed_loops import motion_of_drive
from nanoslip.study.commands.infer import loop_targets, read_loop_numbers
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.toml_text import as_toml
from tests.conftest import Main, compute

LOAD, RIG = 0.2, 150.0
CASE = {
    "constants": {"radius": "100 mm", "normal_load": "0.2 N"},
    "scales": {"slab_width": "2 mm", "young_modulus": "2 MPa"},
}
STAGE = {"spring_stiffness": "150 N/m", "pin_mass": "80 g", "stage_velocity": "0.5 mm/s", "damping_ratio": 1.0}
STROKE = {"name": "stroke", "stage_stroke": "3 mm", "stage_cycles": 3, "samples": 700}
ONE_WAY = {"name": "one_way", "samples": 50}


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a drive whose stage goes to and fro, of one that does not, from two starts."""
    drives = [{**STAGE, **STROKE}, {**STAGE, **ONE_WAY}]
    more = {"title": "Stage", "numerics": {"n_x": 17}, "limits": {"presliding": 4}, "ensemble": {"members": 2}}
    return compute(tmp_path_factory.mktemp("stage"), as_toml({**CASE, **more, "drives": drives}))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of strokes of the pin itself."""
    more = {"title": "Path", "numerics": {"n_x": 33, "scheme": "strip"}, "path": {"amplitude": 1.5, "cycles": 4}}
    return compute(tmp_path_factory.mktemp("path"), as_toml({**CASE, **more, "ensemble": {"members": 2}}))


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a record in one direction."""
    more = {"title": "Record", "stages": ["contact", "slip"], "numerics": {"n_x": 17}, "limits": {"events": 20}}
    return compute(tmp_path_factory.mktemp("record"), as_toml({**CASE, **more}))


def write_recording(file: Path, position: np.ndarray, force: np.ndarray) -> Path:
    """A file of position and force, of a cell with an offset and noise of 0.1 %."""
    random = np.random.default_rng(4)
    read = force + 0.02 + 1e-3 * np.abs(force).max() * random.standard_normal(len(force))
    rows = np.column_stack((0.01 * np.arange(len(force)), 1e6 * position + 500.0, 1e3 * read))
    lines = (",".join(f"{cell:.7g}" for cell in row) for row in rows.tolist())
    file.write_text("\n".join(["Time [s],Position [um],Fx [mN]", *lines]))
    return file


@pytest.fixture(scope="module")
def of_stage(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with api.open(stage / "results.nc") as data:
        run = data.nanoslip.trajectory(drive="stroke").load()
    folder = tmp_path_factory.mktemp("recording")
    return write_recording(folder / "lab.csv", run["sample_stage"].values, LOAD * run["sample_spring_force"].values)


@pytest.mark.slow
def test_a_recording_of_a_computed_stage_has_its_numbers(main: Main, stage: Path, of_stage: Path) -> None:
    """The recorded start is one of two, whose ± is around their mean."""
    words = ("--load", "0.2 N", "--rig", "150 N/m", "--over", stage, "drive=stroke", "--json")
    code, out, errors = main("trace", of_stage, *words)
    assert code == 0, errors
    measured = json.loads(out)
    computed = measured["computed"]
    for name in ("turn_friction", "slip_amplitude", "energy_ratio"):
        assert measured[name]["value"] == pytest.approx(computed[name]["value"], rel=0.01), name
    # One cycle that is left out of the computed ones, which still changes, and two starts.
    for name in ("cycle_energy", "mid_stroke_friction", "contact_amplitude"):
        assert measured[name]["value"] == pytest.approx(computed[name]["value"], rel=0.05), name
        assert computed[name]["uncertainty"] > 0.0, name
    assert computed["cycle_energy"]["unit"] == measured["cycle_energy"]["unit"] == "J"


def test_both_loops_stand_in_one_table_of_80_columns_and_one_picture(
    main: Main, stage: Path, of_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    picture = tmp_path / "over.svg"
    code, out, errors = main("trace", of_stage, "--load", "0.2 N", "--over", stage, "drive=stroke", "-o", picture)
    assert code == 0, errors
    rows = [line.split() for line in out.splitlines()]
    (energy,) = [row for row in rows if row[:1] == ["cycle_energy"]]
    assert energy.count("±") == 2
    assert energy[-1] == "μJ"
    assert "computed" in picture.read_text()


@pytest.mark.slow
def test_strokes_of_a_path_are_those_of_the_contact_behind_the_rig(main: Main, path: Path, tmp_path: Path) -> None:
    with api.open(path / "results.nc") as data:
        run = data.nanoslip.path().load()
        width = data.attrs["slab_width"]
    stiffness = float(run["path_stiffness_si"]) / 2.0
    places, forces = [], []
    for leg in range(run.sizes["turn"]):
        own = run["path_leg"].values == leg
        share = np.linspace(0.0, 1.0, 400)
        displacement, force = width * run["path_displacement"].values[own], LOAD * run["path_friction"].values[own]
        gone = (displacement - displacement[0]) / (displacement[-1] - displacement[0])
        places.append(displacement[0] + share * (displacement[-1] - displacement[0]))
        forces.append(np.interp(share, gone, force))
    force = np.concatenate(forces)
    lab = write_recording(tmp_path / "lab.csv", np.concatenate(places) + force / stiffness, force)
    words = ("--load", "0.2 N", "--rig", f"{stiffness} N/m", "--over", path)
    code, out, errors = main("trace", lab, *words, "--json")
    assert code == 0, errors
    measured = json.loads(out)
    for name in ("contact_stiffness", "contact_amplitude", "turn_friction", "cycle_energy"):
        assert measured[name]["value"] == pytest.approx(measured["computed"][name]["value"], rel=0.05), name
    # Of loads and lengths in SI: the amplitude is that of the path.
    expected = float(run["cycle_stroke_si"]) / 2.0
    assert measured["contact_amplitude"]["value"] == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
def test_results_without_loops_are_refused_by_what_they_have(
    main: Main, stage: Path, record: Path, of_stage: Path
) -> None:
    for words in ((stage, "drive=one_way"), (record,), (stage,)):
        code, _, errors = main("trace", of_stage, "--load", "0.2 N", "--over", *words)
        assert code == 2
        assert errors.count("\n") == 1
    assert main("trace", of_stage, "--over", stage, "drive=stroke")[0] == 2


def test_a_fit_takes_measured_loops_as_a_dataset_has_them(
    main: Main, stage: Path, of_stage: Path, tmp_path: Path
) -> None:
    """Energies in W·L_x; what is given by itself is not taken from the trace."""
    file = tmp_path / "lab.json"
    file.write_text(main("trace", of_stage, "--load", "0.2 N", "--json")[1])
    manifest = load_manifest(stage / "small.toml")
    names = loop_targets(manifest)
    targets = {target.name: target for target in read_loop_numbers(file, names, manifest)}
    with api.open(stage / "results.nc") as data:
        found = data.sel(drive="stroke").squeeze()
        for name, target in targets.items():
            assert target.value == pytest.approx(float(found[name]), rel=0.05), name
            assert target.error > 0.0
            assert target.one_start
    assert {"loop_energy", "midstroke_friction"} == targets.keys()
    assert [each.name for each in read_loop_numbers(file, names, manifest, ["loop_energy"])] == ["midstroke_friction"]


def test_a_fit_to_loops_needs_them_and_scales(main: Main, stage: Path, tmp_path: Path) -> None:
    pull = {"value": 0.3, "uncertainty": 0.01, "of": 9, "unit": "1"}
    loop = {"load": 0.2, "cycle_energy": {"value": 1e-4, "uncertainty": 1e-6, "of": 9, "unit": "J"}}
    document = tomllib.loads((stage / "small.toml").read_text())
    unscaled = tmp_path / "unscaled.toml"
    rest = {name: value for name, value in document.items() if name != "scales"}
    unscaled.write_text(as_toml({**rest, "constants": {"radius": 50.0, "normal_load": 1e-3}}))
    for campaign, numbers in ((stage / "small.toml", {"static_friction": pull}), (unscaled, loop)):
        (tmp_path / "lab.json").write_text(json.dumps(numbers))
        words = ("--trace", tmp_path / "lab.json", "drive=stroke", "--vary", "mu_i=0.2:0.6", "--out", tmp_path / "out")
        code, _, errors = main("fit", campaign, *words)
        assert code == 2
        assert "loops" in errors


@pytest.mark.slow
def test_a_fit_to_strokes_of_a_path_finds_their_friction(main: Main, path: Path, tmp_path: Path) -> None:
    """Loops of one start, of 5 % scatter, and one number that is proportional to μ_i."""
    with api.open(path / "results.nc") as data:
        found = data.squeeze()
        energy = float(found["loss_per_cycle"]) * LOAD * data.attrs["slab_width"]
        turn = float(found["turn_friction"])
    numbers = {"cycle_energy": (energy, "J"), "turn_friction": (turn, "1")}
    measured = {
        name: {"value": value, "uncertainty": 0.02 * value, "unit": unit} for name, (value, unit) in numbers.items()
    }
    (tmp_path / "lab.json").write_text(json.dumps({"load": LOAD, **measured}))
    (tmp_path / "mine.toml").write_text((path / "small.toml").read_text())
    words = ("--trace", tmp_path / "lab.json", "--vary", "mu_i=0.3:0.8", "--points", 16, "--json")
    code, out, errors = main(
        "fit", tmp_path / "mine.toml", *words, "-o", tmp_path / "fit.png", "--out", tmp_path / "out"
    )
    assert code == 0, errors
    ((low, high),) = json.loads(out)["parameters"]["intrinsic_friction"]["95"]
    assert low < 0.5 < high


def test_a_case_without_a_motion_says_what_it_lacks(record: Path) -> None:
    with api.open(record / "results.nc") as data, pytest.raises(ValueError, match=r"needs \[\[drives\]\]"):
        motion_of_drive(data)
