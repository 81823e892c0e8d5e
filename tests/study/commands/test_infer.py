"""What matters and what agrees, from the command line and from Python: a small campaign of contacts, seconds in all."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import nanoslip
from nanoslip.study.commands import infer
from nanoslip.study.commands.infer import read_numbers, read_ranges, read_trace_numbers
from nanoslip.study.inference.campaign import make_question
from nanoslip.study.inference.fit import filling
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.report.page import page
from nanoslip.study.run.child import FarmError
from nanoslip.study.shipped import starters
from tests.conftest import Main
from tests.study.figures.cases import product

CONTACTS = """\
title = "Contacts"
stages = ["contact"]
[axes]
radius = [20.0, 30.0, 45.0]
normal_load = [1e-3, 1.5e-3, 2.25e-3]
[constants]
poisson = 0.3
[numerics]
n_x = 129
"""
SIZE = "contact_half_width"


@pytest.fixture
def contacts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "contacts.toml"
    path.write_text(CONTACTS)
    return path


@pytest.mark.slow
def test_a_fit_whose_processes_cannot_compute_ends_with_their_message(
    main: Main, contacts: Path, monkeypatch: pytest.MonkeyPatch
):
    """As where somebody changes the program while it runs: `run` ends so too."""

    def refuse(*_: object) -> None:
        raise FarmError("rank 0 has other software than the run began with")

    monkeypatch.setattr(infer, "_compute_fit", refuse)
    code, _, errors = main("fit", contacts, f"{SIZE}=0.14+-0.002", "normal_load=1.5e-3", "-j", 1)
    assert code == 2
    assert "Error: rank 0 has other software" in errors


def test_what_matters_to_a_contact(main: Main, contacts: Path):
    """Hertz: a² is proportional to W·R, and both are varied by the same factor: each has half of the variance."""
    data = nanoslip.run(contacts, "results/contacts")
    found = nanoslip.sensitivity(data, SIZE)
    assert found.axes == ("radius", "normal_load")
    assert found.complete
    assert found.first[:, 0] == pytest.approx([0.5, 0.5], abs=0.06)  # and what they do together, and the slab's ends
    code, out, _ = main("sensitivity", contacts, "--of", SIZE, "-o", "bars.png")
    assert code == 0
    assert "all 9 points" in out
    assert Path("bars.png").stat().st_size > 5000
    code, out, _ = main("sensitivity", contacts, "--of", SIZE, "--json")
    rows = json.loads(out)["axes"]
    assert rows["radius"]["first"][0] == pytest.approx(found.first[0, 0])
    code, _, errors = main("sensitivity", contacts, "--of", "no_such_number")
    assert code == 2
    assert "no_such_number: " in errors


@pytest.mark.slow
def test_a_fit_finds_what_was_put_in_and_computes_nothing_twice(main: Main, contacts: Path):
    """The contact of a known radius as the measurement; a second run has every point in the campaign's results."""
    truth = nanoslip.run(
        {
            "title": "Truth",
            "stages": ["contact"],
            "numerics": {"n_x": 129},
            "constants": {"radius": 33.0, "normal_load": 1.5e-3, "poisson": 0.3},
        }
    )
    size = float(truth[SIZE].squeeze())
    words = ("fit", contacts, f"{SIZE}={size:.5f}+-0.002", "normal_load=1.5e-3", "--vary", "radius", "-o", "agree.png")
    code, out, errors = main(*words, "-j", 1)
    assert code == 0, errors
    assert "17 tasks of" in errors
    found = nanoslip.fit(
        contacts, {SIZE: (size, 0.002)}, ["radius"], {"normal_load": 1.5e-3}, "results/contacts", progress=True
    )
    low, high = found.intervals(0, 0.95)[0] or (0.0, 0.0)
    assert low < 33.0 < high < low + 10.0
    row = next(line for line in out.splitlines() if line.startswith("radius"))
    _, printed, _ = re.findall(r"(\S+) to (\S+)", row)
    # The same from any number of processes, in the three digits printed: rounding moves the fifth one.
    assert [*map(float, printed)] == pytest.approx([low, high], rel=2e-3)
    assert Path("agree.png").stat().st_size > 5000
    code, again, errors = main(*words)
    assert (code, again) == (0, out)
    assert "new points" not in errors
    code, text, errors = main(*words, "--json")
    assert (code, "written: agree.png" in errors) == (0, True)
    scripts = json.loads(text)
    assert scripts["parameters"]["radius"]["95"] == [pytest.approx([low, high], rel=1e-3)]
    assert scripts["numbers"][SIZE]["best"] == pytest.approx(size, abs=0.002)
    assert (scripts["reached"], scripts["points"]) == (True, 16)
    nanoslip.run(contacts, "results/contacts")  # whose own cases are taken as they are
    more = nanoslip.fit(contacts, {SIZE: (size, 0.002)}, ["radius"], {"normal_load": 1.5e-3}, "results/contacts")
    assert more.ranges[0].at(more.computed.x[:3, 0]) == pytest.approx([20.0, 30.0, 45.0])


@pytest.mark.slow
def test_a_setting_of_a_drive_is_found_and_what_is_expected_is_printed_before(main: Main, contacts: Path):
    """Each point has its own drive: a run of the best one, from the file that is written, has the number printed for it."""
    drive = '[[drives]]\nname = "a"\nstep_limit = 1000\n[outputs]\ntrajectory = false\n'
    contacts.write_text('title = "x"\nnumerics = {n_x = 33, scheme = "strip"}\nensemble.members = 2\n' + drive)
    words = ("fit", contacts, "mu_s=0.3±0.02", "--points", 16, "--vary")
    code, _, errors = main(*words, "stage_velocity=1 mm/s:4 mm/s,k=1e5:4e5")
    assert (code, errors.count("at step_limit")) == (2, 1)
    assert "at first; then" in errors  # no time before one is measured
    assert "step_limit: " in errors
    assert "raise step_limit" in " ".join(errors.partition("Error: ")[2].split())
    contacts.write_text(contacts.read_text().replace("step_limit = 1000\n", ""))
    code, out, errors = main(*words, "stage_velocity=1 mm/s:4 mm/s,k=1e5:4e5")
    assert code == 0, errors
    assert re.search(r"at first, about \d", errors)
    assert re.search(r"stage_velocity .* to 0.004", out)
    data = nanoslip.run("contacts_best.toml").squeeze()
    printed = float(re.findall(r"Computed there: mu_s = (\S+) ±", out)[0])
    assert float(data.static_friction) == pytest.approx(printed, abs=1e-3)
    assert data.nanoslip.trajectory().sizes["sample"] > 100


IMPOSSIBLE = "effects.pin_translation = false\nslip.residual_shear = 1.0\n"


@pytest.mark.parametrize(
    ("changed", "words", "advice"),
    [
        ('[[drives]]\nduration = "1e-6 s"\n', ("mu_s=0.3±0.02", "--vary", "mu_i=0.3:0.6"), "needs duration"),
        ("[limits]\npresliding = 1.0\n", ("plateau/mu_i=0.5±0.02", "--vary", "mu_i=0.3:0.6"), "limits.presliding"),
        ("[limits]\nevents = 5\n", ("plateau=0.3±0.02", "--vary", "mu_i=0.3:0.6"), "events"),
        (IMPOSSIBLE, ("plateau=0.3±0.02", "--vary", "mu_i=0.3:0.6"), "pin_translation"),
    ],
)
def test_what_no_point_can_have_is_refused_before_anything_is_computed(
    main: Main, contacts: Path, changed, words, advice
):
    """A drive that never pulls as hard as friction holds, records that end before they are steady, impossible pins."""
    contacts.write_text('title = "x"\nnumerics = {n_x = 33, scheme = "strip"}\nensemble.members = 3\n' + changed)
    code, _, errors = main("fit", contacts, *words)
    assert code == 2
    assert advice in errors
    assert not Path("results").exists()


@pytest.mark.slow
def test_why_cases_have_no_number_is_said(main: Main, contacts: Path):
    """The contact of a small radius has few nodes, so its number is flagged: both commands say so, and how many."""
    contacts.write_text(CONTACTS.replace("radius = [20.0,", "radius = [0.2, 20.0,"))
    nanoslip.run(contacts, "results/contacts")
    text = " ".join(main("sensitivity", contacts, "--of", SIZE)[1].split())
    assert "From all 12 points" in text
    assert "few_nodes: 3 of 12 cases" in text
    text = main("fit", contacts, f"{SIZE}=0.1±0.01", "normal_load=1e-3", "--vary", "radius=0.2:45")[1]
    assert re.search(r"validity flag few_nodes: \d+ of them", " ".join(text.split()))


SHEARED = """\
title = "A part of the limit that needs no pressure"
stages = ["contact", "slip"]
[numerics]
n_x = 33
scheme = "half_plane"
"""
STRENGTH = 3e-4
"""In G: half of the mean limit by pressure at μ_i = 0.2 and the default load."""


@pytest.mark.slow
def test_both_parts_of_a_limit_share_the_variance_of_friction(main: Main, contacts: Path):
    """F/W = μ_i + τ_0·A/W of classical sliding: variances of both add, of an area that shear does not change."""
    axes = "[axes]\nintrinsic_friction = [0.1, 0.2, 0.3]\nstrength = [1e-4, 3e-4, 5e-4]\n"
    rules = (
        "[slip]\nresidual_shear = 1\n[effects]\ncoupling = false\n[limits]\npresliding = 1.5\n[ensemble]\nmembers = 1\n"
    )
    contacts.write_text(SHEARED + axes + rules)
    data = nanoslip.run(contacts, "results/contacts")
    found = nanoslip.sensitivity(data, "final_force")
    area = float(data.initial_contact_size.values.ravel()[0]) / 32.0
    variances = np.var(data.intrinsic_friction.values), np.var(data.strength.values * area / 1e-3)
    assert found.axes == ("intrinsic_friction", "strength")
    assert found.first[:, 0] == pytest.approx(np.array(variances) / sum(variances), rel=1e-6)
    np.testing.assert_allclose(found.total[:, 0], found.first[:, 0], rtol=1e-6)
    code, out, _ = main("sensitivity", contacts, "--of", "final_force", "--json")
    assert (code, json.loads(out)["axes"]["strength"]["first"][0]) == (0, pytest.approx(found.first[1, 0]))


@pytest.mark.slow
def test_a_strength_is_found_where_the_other_part_of_the_limit_is_known(main: Main, contacts: Path):
    """Friction at one load: with μ_i it gives the strength that was put in, and without it only a line of both."""
    axes = "[axes]\nintrinsic_friction = {from = 0.1, to = 0.5}\nstrength = {from = 1e-4, to = 5e-4}\n"
    limits = "[limits]\npresliding = 8\nspacings = 2\nevents = 20000\n[ensemble]\nmembers = 4\n"
    contacts.write_text('design = "sobol"\n' + SHEARED + axes + limits)
    truth = nanoslip.run(
        {
            **tomllib.loads(SHEARED),
            "constants": {"intrinsic_friction": 0.2},
            "slip": {"strength": STRENGTH},
            "limits": {"presliding": 20, "spacings": 4, "events": 40_000},
        }
    )
    plateau = float(truth.plateau_mean.squeeze())
    words = ("fit", contacts, f"plateau={plateau:.4f}±0.01", "--json", "-j", 1)
    code, out, errors = main(*words, "intrinsic_friction=0.2", "--vary", "strength")
    assert code == 0, errors
    ((low, high),) = json.loads(out)["parameters"]["strength"]["95"]
    assert low < STRENGTH < high < low + 1.5e-4
    code, out, errors = main(*words, "--vary", "strength,intrinsic_friction")
    assert code == 0, errors
    ((low, high),) = json.loads(out)["parameters"]["strength"]["95"]
    assert high > low + 3.5e-4


MEASURED = {"contact": "contact_half_width=0.2±0.02", "slip": "plateau/mu_i=0.54±0.02", "dynamics": "mu_k=0.2±0.02"}
"""A number that a campaign has by its last stage."""
LOOP = "loop_energy=0.4±0.02"
"""A number of a stage that goes to and fro."""


def walked(starter: str, main: Main, folder: Path) -> tuple[Path, list[str]]:
    """The file that `nanoslip new` writes, and the words of a fit of μ_i over its first values of all else."""
    path = folder / f"{starter}.toml"
    assert main("new", starter, path)[0] == 0
    given = tomllib.loads(path.read_text("utf-8"))
    stages = given.get("stages", ["contact", "slip", *(["dynamics"] if "drives" in given else [])])
    axes = {**given.get("axes", {}), **given.get("drive_axes", {})}
    held = {key: values[0] for key, values in axes.items() if isinstance(values, list) and key != "intrinsic_friction"}
    held |= {key: span["from"] for key, span in axes.items() if isinstance(span, dict) and key != "intrinsic_friction"}
    drives = [each["name"] for each in given.get("drives", []) if "name" in each]
    keys_of_drives = {key for each in given.get("drives", []) for key in each}
    several = [f"drive={drives[0]}"] if len(drives) > 1 and "dynamics" in stages else []
    words = [f"{key}={value}" for key, value in held.items()]
    measured = LOOP if "stage_stroke" in keys_of_drives else MEASURED[stages[-1]]
    return path, [measured, *words, *several, "--vary", "mu_i=0.3:0.6", "--points", "16"]


@pytest.mark.slow
@pytest.mark.parametrize("starter", [name for name in starters() if name != "strokes"])
def test_every_starter_can_be_fitted(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, starter: str):
    """All that a fit of it would compute is a valid case, and has the number. Strokes have loops instead of a plateau."""
    monkeypatch.chdir(tmp_path)
    path, words = walked(starter, main, tmp_path)
    targets, fixed = read_numbers(words[:-4])
    question = make_question(load_manifest(path), targets, read_ranges([words[-3]]), fixed)
    question.check(tmp_path / "results")
    cases = [case for plan in question.plans(filling(1)) for case in plan.cases]
    assert len(cases) == 16
    assert all(case.outcome.ok for case in cases)


SMALLER = {"n_x = [25, 33]": "n_x = [9, 13]", "members = 4": "members = 2"}
"""Settings of the ball's starter, and those with which 16 points take seconds instead of minutes."""


@pytest.mark.slow
@pytest.mark.parametrize("starter", ["afm", "sweep", "ball"])
def test_a_starter_goes_from_new_to_fit(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, starter: str):
    monkeypatch.chdir(tmp_path)
    path, words = walked(starter, main, tmp_path)
    if starter == "ball":
        text = path.read_text("utf-8")
        for usual, smaller in SMALLER.items():
            assert text.count(usual) == 1
            text = text.replace(usual, smaller)
        path.write_text(text, "utf-8")
        words = [word.replace("n_x=25", "n_x=9") for word in words]
    code, out, errors = main("fit", path, *words)
    assert code == 0, errors
    assert "16 points are computed" in " ".join(out.split())
    assert (tmp_path / f"{starter}_best.toml").exists()


def test_a_page_of_three_axes_shows_what_matters():
    """Bars with their numbers from three axes on, two have a map; and no bars, but the reason, where nothing is known."""
    axes = {"poisson": [0.0, 0.3], "radius": [20.0, 30.0, 45.0], "normal_load": [1e-3, 1.5e-3, 2.25e-3]}
    data = product(lambda poisson, radius, normal_load: (1.0 - poisson**2) * radius * normal_load, **axes)
    for name, variable in data.variables.items():
        variable.attrs |= {"long_name": str(name), "units": "1"}
    text = page(data, [])
    assert "What matters" in text
    assert 'download="sensitivity_plateau_mean.csv"' in text
    assert "a complete table" in text
    assert "What matters" not in page(data.isel(poisson=[0]), [])
    few = data.assign(plateau_mean=data["plateau_mean"].where(data.radius < 25.0))  # of one radius, six cases
    assert "6 of 18 points" in page(few, [])


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("mu_i=0.3",), "needs a measured number with its ±"),
        ((f"{SIZE}=0.1",), "a measured number needs its ±"),
        ((f"{SIZE}=0.1±0",), "needs a ± above 0"),
        ((f"{SIZE}=0.1±0.01", "normal_load=1e-3", "radius=30", "--vary", "n_x"), "--vary n_x: takes no range"),
        ((f"{SIZE}=0.1±0.01", "--vary", "radius"), "normal_load: has 3 values in the campaign"),
        (
            (f"{SIZE}=0.1±0.01", "normal_load=1e-3", "--vary", "radius=45:20"),
            "needs a range from a smaller to a larger number",
        ),
        (
            (f"{SIZE}=0.1±0.01", "normal_load=1e-3", "radius=30", "--vary", "poisson"),
            "poisson: has no range in the campaign",
        ),
        ((f"{SIZE}=nan±0.01",), f"{SIZE} = nan ± 0.01: needs"),
        ((f"{SIZE}=0.1±1e300",), f"{SIZE} = 0.1 ± 1e+300: needs"),
        ((f"{SIZE}=0.1±0.01", "a=0.2±0.01"), "needs each number once"),
        ((f"{SIZE}=0.1±0.01", "radius=30", "radius=40"), "radius=40: radius is given twice"),
        ((f"{SIZE}=0.1±0.01", "R=30", "radius=40"), "needs each parameter once"),
        ((f"{SIZE}=0.1±0.01", "--vary", "radius=20:30,radius=30:40"), "radius is given twice"),
        ((f"{SIZE}=0.1±0.01", "--vary", "R=20:30,radius=30:40"), "needs each parameter once"),
        ((f"{SIZE}=0.1±0.01", "normal_load=1e-3", "radius=30", "--vary", "mu_i=0.1:inf"), "both finite"),
        (("mu_s=0.1±0.01",), "mu_s: no variable of this dataset"),
        ((f"{SIZE}=0.1±0.01", "--vary", "radus=20:30"), "--vary radus: unknown; did you mean radius?"),
        ((f"{SIZE}=0.1±0.01", "normal_load=1e-3", "radius=30", "--vary", "start_y=0.1:0.9"), "start_y"),
        ((f"{SIZE}=0.1±0.01", "normal_lod=1e-3"), "normal_lod=1e-3: unknown; did you mean normal_load?"),
        (("mu_k=0.3",), "mu_k=0.3: no parameter; a measured number needs its ±"),
        ((f"{SIZE}=0.1±0.01", "normal_load=1e-3", "--vary", "radius=20mm:45"), "Error: --vary radius=20mm:45: needs"),
    ],
)
def test_wrong_questions_are_refused_before_anything_is_computed(main: Main, contacts: Path, words, problem):
    code, _, errors = main("fit", contacts, *words)
    assert code == 2
    assert problem in errors
    assert not Path("results").exists()


@pytest.mark.slow
def test_a_fit_takes_the_friction_of_a_trace(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The trace is a drive of the campaign itself; what is given by itself is not taken from it."""
    monkeypatch.chdir(tmp_path)
    drive = '[[drives]]\nname = "soft"\nspring_stiffness = 2e4\nstage_velocity = 1e-3\nsamples = 10000\n'
    text = 'title = "x"\nnumerics = {n_x = 33, scheme = "strip"}\nensemble.members = 3\n'
    Path("mine.toml").write_text(text + drive)
    truth = {"constants": {"intrinsic_friction": 0.4}, "drives": tomllib.loads(drive)["drives"]}
    data = nanoslip.run({**tomllib.loads(text), **truth, "ensemble": {"members": 1}}, progress=False).squeeze()
    motion = data.nanoslip.trajectory()
    np.savetxt("lab.csv", np.column_stack([motion["time"], 100.0 * motion["sample_spring_force"]]), delimiter=",")
    _, written, _ = main("trace", "lab.csv", "--load", "100 N", "--json")
    Path("lab.json").write_text(written)
    (static, kinetic) = read_trace_numbers(Path("lab.json"))
    assert (static.name, kinetic.name) == ("static_friction", "kinetic_friction")
    assert kinetic.value == pytest.approx(float(data["kinetic_friction"]), abs=3.0 * kinetic.error)
    assert [target.name for target in read_trace_numbers(Path("lab.json"), ["mu_s"])] == ["kinetic_friction"]
    Path("other.json").write_text("[]")
    code, _, errors = main("fit", "mine.toml", "--trace", "other.json")
    assert code == 2
    assert "nanoslip trace FILE --load" in " ".join(errors.split())
    code, _, errors = main("fit", "mine.toml", "--trace", "lab.csv")
    assert code == 2
    assert "nanoslip trace lab.csv --load FORCE --json" in " ".join(errors.split())
    assert all(target.one_start for target in (static, kinetic))


@pytest.mark.slow
def test_a_fit_to_a_trace_finds_its_friction(main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Plateaus of one μ_i differ by 2 % between starts of this grid, and are proportional to it."""
    monkeypatch.chdir(tmp_path)
    text = 'title = "x"\nnumerics = {n_x = 33, scheme = "strip"}\nensemble.members = 3\ndrives = [{name = "a"}]\n'
    Path("mine.toml").write_text(text)
    data = nanoslip.run({**tomllib.loads(text), "constants": {"intrinsic_friction": 0.4}}, progress=False).squeeze()
    of = ("static_friction", "kinetic_friction")
    numbers = {name: {"value": float(data[name]), "uncertainty": 0.005, "of": 9, "unit": "1"} for name in of}
    Path("lab.json").write_text(json.dumps(numbers))
    words = ("--trace", "lab.json", "--vary", "mu_i=0.2:0.6", "--points", 16, "--out", "out")
    code, out, errors = main("fit", "mine.toml", *words)
    assert code == 0, errors
    assert float(re.findall(r"intrinsic_friction\s+(\S+)", out)[0]) == pytest.approx(0.4, rel=0.04)
