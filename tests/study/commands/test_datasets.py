"""Finished datasets: verified, compared, described, exported, reported and drawn; what cannot be is one clear message."""

import csv
import json
import os
import re
import shutil
from contextlib import nullcontext
from pathlib import Path

import netCDF4
import pytest

import nanoslip as nanoslip_here
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.outcome import Ending
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.study.commands import cli, draw
from nanoslip.study.dataset import file
from nanoslip.study.dataset.file import load_dataset
from nanoslip.study.dataset.variables import rows
from nanoslip.study.figures import shared
from nanoslip.study.figures.gallery import list_shipped_figures
from nanoslip.study.report import page
from nanoslip.study.run import executor
from tests.conftest import SMALL, compute
from tests.study.figures.cases import product
from tests.study.figures.shipped_small import small
from tests.study.run.defects import crashing


def one_line(answer, wanted):
    """It is exit code 2 and one line of error that says so; returns standard output, mostly none."""
    code, said, errors = answer
    assert (code, errors.count("\n"), wanted in errors) == (2, 1, True), errors
    return said


@pytest.mark.slow
def test_a_dataset_is_verified_from_itself_alone(main, campaign, finished, tmp_path):
    path = (finished / "results.nc").rename(tmp_path / "alone.nc")
    shutil.rmtree(finished)
    campaign.unlink()
    code, said, progress = main("verify", path)
    assert (code, "13 of 13 tasks done" in progress) == (0, True)
    counts = "4 bit-identical, 0 within rounding, 0 within uncertainties, 0 different"
    assert said == f"{path}: cases: {counts}; what all cases share: bit-identical\n"
    with netCDF4.Dataset(path, "a") as opened:
        opened["mean_step"][1, 1, 0, 0] *= 1.0 + 1e-6
    code, said, _ = main("verify", path)
    (line,) = said.splitlines()[:-1]
    assert (code, ": mean_step by " in line) == (1, True)
    assert line.startswith("different: intrinsic_friction = 0.5, radius = 100")
    assert "3 bit-identical, 0 within rounding, 0 within uncertainties, 1 different" in said
    path.rename(tmp_path / "results.nc")
    code, said, _ = main("verify", tmp_path, "--sample", 1)
    assert (code, "1 bit-identical, 0 within rounding, 0 within uncertainties, 0 different, 3 not" in said) == (0, True)


@pytest.mark.slow
def test_tasks_that_crash_disagree_with_nothing_there_or_here(main, run, out, monkeypatch):
    defective = crashing(lambda task: task.kind == "record" and task.case.radius > 60.0)
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", defective)
        assert run()[0] == 3
        code, said, progress = main("verify", out)
    counts = "2 bit-identical, 0 within rounding, 0 within uncertainties, 0 different, 2 failed, skipped"
    assert (code, f"cases: {counts}" in said, "2 of 4 cases" in progress) == (0, True, True)
    assert run("--retry")[0] == 0
    monkeypatch.setattr(executor, "run_task", defective)
    code, said, errors = main("verify", out)
    assert (code, said) == (3, "")
    assert "6 tasks failed" in errors


def test_a_dataset_without_any_result_cannot_be_computed_again(main, run, out, monkeypatch):
    monkeypatch.setattr(executor, "run_task", crashing(lambda task: True))
    assert run()[0] == 3
    for options in ((), ("--json",)):
        said = f"Error: {out / 'results.nc'}: no case has a result to compute again: 4 failed\n"
        assert main("verify", out, *options) == (2, "", said)


def test_what_cannot_be_verified_is_one_clear_message(main, campaign):
    one_line(main("verify", campaign), f"{campaign}: no dataset")
    one_line(main("verify", campaign.parent / "none.nc"), "none.nc: no dataset (No such file")
    assert main("verify", campaign, "--sample", 0)[0] == 2


# What cannot be written is known before it is computed; what may not be read is not replaced.


def test_a_file_that_cannot_be_written_is_refused_before_it_is_computed(main, campaign, finished, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)
    one_line(
        main("show", campaign, "--out", finished, "-o", finished / "x.png"), "x.png: cannot be written: Permission"
    )
    assert main("export", campaign, "--out", finished, "-o", "-")[0] == 0
    code, said, errors = main("accuracy", campaign, "--quick", "--out", campaign / "in")
    assert (code, said, errors.count("\n"), str(campaign / "in") in errors) == (2, "", 1, True)


def test_a_dataset_that_may_not_be_read_is_not_replaced(ask, finished, monkeypatch):
    before = (finished / "results.nc").read_bytes()
    (finished / "results" / "dataset.json").unlink()
    with monkeypatch.context() as patched:
        patched.setattr(os, "access", lambda path, mode: Path(path).suffix != ".nc")
        code, _, errors = ask("collect")
    assert (code, "may not read" in " ".join(errors.split()), (finished / "results.nc").read_bytes() == before) == (
        2,
        True,
        True,
    )
    assert ask("collect", "--replace")[0] == 0


# What somebody has added to a dataset stays.


def annotate(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as found:
        found.setncattr("comment", "left rig")


@pytest.mark.slow
def test_a_current_dataset_keeps_what_somebody_has_added(run, campaign, finished):
    path = finished / file.FILE
    annotate(path)
    whole = path.read_bytes()
    assert run()[0] == 0
    with nanoslip_here.run(campaign, finished) as found:
        assert found.attrs["comment"] == "left rig"
    assert path.read_bytes() == whole


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["a letter", "a part", "more"])
def test_a_dataset_whose_last_line_is_damaged_is_written_anew_and_was_edited_by_nobody(run, finished, damage):
    path = finished / file.FILE
    whole = path.read_bytes()
    path.write_bytes(
        {"a letter": whole[:-20] + b"?" + whole[-19:], "a part": whole[:-20], "more": whole + b"?"}[damage]
    )
    assert run()[0] == 0
    assert path.read_bytes() == whole
    assert not list(finished.glob("*.set-aside-*"))


@pytest.mark.slow
def test_an_edited_dataset_that_is_written_anew_is_kept(run, campaign, finished):
    annotate(finished / file.FILE)
    whole = (finished / file.FILE).read_bytes()
    campaign.write_text(f"{campaign.read_text()}\n# the same cases, another text\n")
    code, _, errors = run()
    aside = finished / f"{file.FILE}.set-aside-1"
    assert (code, str(aside) in errors.replace("\n", ""), aside.read_bytes() == whole) == (0, True, True)
    with nanoslip_here.open(finished) as found:
        assert "comment" not in found.attrs


def test_a_dataset_that_is_open_for_writing_is_named_so_and_not_replaced(run, campaign, finished, main):
    path = finished / file.FILE
    with netCDF4.Dataset(path, "a") as held:
        held.setncattr("comment", "left rig")
        for code, _, errors in (run(), main("show", campaign, "--out", finished), main("compare", path, path)):
            assert (code, "open for writing" in " ".join(errors.split()), "damaged" in errors) == (2, True, False)
    assert run()[0] == 0
    with nanoslip_here.open(finished) as found:
        assert found.attrs["comment"] == "left rig"


# Compared, case by case: exit code 0 within uncertainties, 1 beyond, 2 where there is nothing to compare.


@pytest.mark.slow
def test_a_dataset_is_the_same_as_itself_whatever_it_is_named_by(main, campaign, finished, tmp_path, monkeypatch):
    code, said, _ = main("compare", finished, finished / "results.nc")
    assert (code, "same parameters" in said) == (0, True)
    assert "cases in both: 4\ndrives of cases in both: 8\n" in said
    assert said.rstrip().endswith(", 0 beyond")
    monkeypatch.chdir(tmp_path)
    assert main("compare", campaign, finished)[0] == 2  # there is no folder results/small here
    (tmp_path / "results").mkdir()
    assert main("compare", campaign, finished.rename(tmp_path / "results" / "small"))[0] == 0


THREE = SMALL.replace("members = 1", "members = 3")
"""± needs members."""


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """A folder with the dataset of the small campaign over three members: not to be changed."""
    return compute(tmp_path_factory.mktemp("three"), THREE)


@pytest.mark.slow
def test_a_finer_surface_differs_and_the_largest_differences_come_first(main, three, tmp_path, monkeypatch):
    finer = THREE.replace("n_x = 17", "n_x = 33").replace("[50.0, 100.0]", "[50.0, 200.0]")
    code, said, _ = main("compare", three, compute(tmp_path, finer))
    monkeypatch.setenv("COLUMNS", "80")
    narrow = main("compare", three, tmp_path)[1]
    assert max(map(len, narrow.splitlines())) <= 80
    assert re.search(r"^differs: n_x\n +A: \d+\n +B: \d+$|^n_x +\d+ +\d+ *$", narrow, re.M)
    assert re.search(r"^observable .* apart/σ", narrow, re.M)
    lines = [line.split() for line in said.splitlines()]
    assert ["n_x", "17", "33"] in lines
    assert ["radius", "50.0,", "100.0", "50.0,", "200.0"] in lines
    assert "A alone: 2, first μ_i = 0.25, R/L_x = 100" in said
    assert (code, next(word for line in lines for word in line if word in ("beyond", "within"))) == (1, "beyond")


@pytest.mark.slow
def test_what_is_within_uncertainties_is_exit_code_0(main, three, tmp_path):
    shutil.copy(three / "results.nc", tmp_path)
    for factor, code, verdict in ((1.0 + 1e-6, 0, "within"), (2.0, 1, "beyond")):
        with netCDF4.Dataset(tmp_path / "results.nc", "a") as opened:
            opened.set_auto_mask(False)
            opened["plateau_mean"][:] *= factor
        ended, said, _ = main("compare", three, tmp_path)
        assert (ended, verdict in said, "plateau_mean" in said) == (code, True, True)


def write_regimes(out, **members):
    with file.open_dataset(out / file.FILE) as found:
        changed = load_dataset(found)
    changed["regime"].values[...] = max(members, key=members.__getitem__)
    for word in REGIMES:
        changed[f"regime_{word}_members"].values[...] = members.get(word, 0)
    file.write_netcdf(changed, out / file.FILE)


@pytest.mark.slow
def test_words_of_members_are_told_in_short_unless_the_difference_hides_behind_the_most_frequent_one(
    main, three, tmp_path
):
    one, other = (shutil.copytree(three, tmp_path / name) for name in ("one", "other"))
    write_regimes(one, sticks=2, stick_slip=1, micro_slip=1)
    for members, told in (
        (
            {"sticks": 2, "slides": 1, "micro_slip": 1},
            "2 of 4 starts sticks; 1 stick-slip; 1 micro-slip  2 of 4 starts sticks; 1 slides; 1 micro-slip",
        ),
        (
            {"stick_slip": 2, "sticks": 1, "micro_slip": 1},
            "2 of 4 starts sticks; 2 others  2 of 4 starts stick-slip; 2 others",
        ),
    ):
        write_regimes(other, **members)
        assert " ".join(told.split()) in " ".join(main("compare", one, other)[1].split())


@pytest.mark.slow
def test_what_cannot_be_compared_is_one_clear_message(main, ask, campaign, finished, tmp_path):
    (tmp_path / "other").mkdir()
    other = compute(tmp_path / "other", SMALL.replace("[50.0, 100.0]", "[200.0, 300.0]"))
    assert main("collect", campaign, "--out", tmp_path / "empty")[0] == 0
    one_line(main("compare", finished, other), "share no computed case")
    one_line(main("compare", finished, tmp_path / "empty"), "share no computed case")


# Described.


def test_all_variables_are_listed_with_unit_and_meaning(main):
    code, said, _ = main("describe")
    assert (code, [one.name for one in rows() if one.name not in said]) == (0, [])
    (line,) = (line for line in said.splitlines() if line.startswith("sample_velocity "))
    assert line.split(maxsplit=3)[1:3] == ["m", "s-1"]


def test_every_flag_ending_and_regime_is_explained_by_its_name(main):
    for name in (*(flag.name for flag in FLAGS), *Ending, *REGIMES):
        code, said, _ = main("describe", name)
        assert (code, said.partition(":")[0], len(said.split()) > 3) == (0, name, True), name


@pytest.mark.parametrize(
    "words",
    [
        ("mean_step", "in L_x", "mean_step_uncertainty"),
        ("radius", "R/L_x", "≤ radius ≤", "default: 200", 'radius = "200 mm"'),
        ("outcome",),
        ("presliding", "[limits]"),
    ],
)
def test_one_variable_is_explained_and_an_unknown_one_refused_with_similar_names(main, words):
    code, said, _ = main("describe", words[0])
    assert (code, [word for word in words if word not in said]) == (0, [])
    assert main("describe", "mu_s")[1].startswith("static_friction\n")
    assert main("describe", "plateau")[1].startswith("plateau_mean\n")
    for word, meant in {
        "mean_stp": "mean_step",
        "mus": "static_friction",
        "muk": "kinetic_friction",
        "wear": "not mod",
    }.items():
        one_line(main("describe", word), meant)
    for word, key in {"youngs": "young_modulus", "thickness": "aspect_ratio"}.items():
        assert main("describe", word)[1].startswith(f"{key}\n")


def test_what_validity_flags_ask_for_is_described(main):
    said = " ".join(main("describe", "validity_flags")[1].split())
    assert [each.name for each in FLAGS if f"{each.name}: {each.meaning}; {each.advice}" not in said] == []


# Exported, to standard output or as a whole file.


@pytest.mark.slow
def test_cases_events_and_samples_are_exported(main, ask, finished, tmp_path):
    code, said, errors = ask("export")
    header, *lines = csv.reader(said.splitlines())
    assert (code, errors, len(lines), len(lines[0])) == (0, "", 8, len(header))
    assert main("export", finished, "--csv") == (0, said, "")
    target = tmp_path / "new" / "table.JSON"
    assert not one_line(main("export", finished / "results.nc", "-o", target), f"no folder {target.parent}")
    target.parent.mkdir()
    assert main("export", finished / "results.nc", "-o", target) == (0, "", f"written: {target} (8 rows)\n")
    assert [row["drive"] for row in json.loads(target.read_text("utf-8"))["rows"]] == ["slow", "fast"] * 4
    assert [path.name for path in target.parent.iterdir()] == ["table.JSON"]
    assert main("export", finished, "--records")[1].count("\n") == 1 + 4 * 200
    assert len(json.loads(main("export", finished, "--json", "--trajectories")[1])["rows"]) == 8 * 41


@pytest.mark.slow
def test_pending_cases_are_rows_without_numbers(main, ask, out):
    assert ask("collect")[0] == 0
    found = json.loads(main("export", out, "--json")[1])["rows"]
    assert {(row["outcome"], row["plateau_mean"]) for row in found} == {("pending", None)}
    code, said, _ = main("export", out, "--records")
    assert (code, said.count("\n")) == (0, 1)


def test_what_cannot_be_exported_is_one_clear_message(main, campaign, tmp_path):
    campaign.write_text('title = "Contact"\nstages = ["contact"]\n[numerics]\nn_x = 17\n')
    out = tmp_path / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert not one_line(main("export", out, "--records"), "no group record")
    assert not one_line(main("export", out, "-o", campaign / "x.csv"), "cannot be written")


# Reported: the page needs a dataset, whole, and its place is said.


@pytest.mark.slow
def test_a_report_repeats_no_table_that_its_run_has_printed(run, ask, finished):
    """One after the other, as `make run` calls them, they print it once."""
    assert "plateau" in run()[1]
    assert ask("report")[:2] == (0, f"report: {finished / page.FILE}\n")
    assert (finished / page.FILE).is_file()


def test_a_report_of_a_campaign_that_has_changed_since_is_refused(ask, campaign, finished):
    """Else it would show the numbers of another campaign below the title of this one."""
    campaign.write_text(SMALL.replace("n_x = 17", "n_x = 9"))
    code, _, said = ask("report")
    assert (code, (finished / page.FILE).exists()) == (2, False)
    assert f"no dataset of {campaign}" in said


# Drawn.


def test_the_command_knows_the_formats_that_can_be_drawn():
    assert set(cli.FORMAT.choices) == set(shared.FORMATS)


@pytest.mark.slow
def test_without_a_name_every_figure_is_listed(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = " ".join(main("figure")[1].split())
    assert all(
        name in said and " ".join(figure.title.split()) in said for name, figure in list_shipped_figures().items()
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_named_figures_are_drawn_and_their_tables_shown(tmp_path, capsys, monkeypatch):
    asked, data, into = [], small("figures/resolution").copy(), tmp_path / "into"

    def computed(campaign, out, progress):
        asked.append((campaign.name, out, progress))
        return data

    monkeypatch.setattr(draw.api, "run", computed)
    draw.draw_figure(("fig8",), False, ("svg",), into, tmp_path / "out", "", "", "", None, False, None, "")
    assert asked == [("resolution.toml", tmp_path / "out" / "figures" / "resolution", True)]
    assert sorted(path.name for path in (into / "figures").iterdir()) == ["fig8.md", "fig8.svg"]
    assert "mean step" in capsys.readouterr().out


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    """A dataset that stands for the file results.nc."""
    made = product(intrinsic_friction=[0.25, 0.5], radius=[50.0, 100.0, 200.0])
    monkeypatch.setattr(draw, "find_dataset", lambda source, out: nullcontext({tmp_path: made}[source]))
    return made


def test_a_number_of_a_campaign_is_drawn_over_the_axes_that_are_asked_for(main, tmp_path, dataset):
    target = tmp_path / "fig.svg"
    code, said, _ = main("figure", tmp_path, "--y", "plateau/mu_i", "--hue", "R/L_x", "-o", target, "--csv")
    assert (code, "against μ_i" in said) == (0, True)
    assert target.read_text("utf-8").startswith("<?xml")
    lines = target.with_suffix(".csv").read_text("utf-8").splitlines()
    assert lines[0].startswith("intrinsic_friction,radius,plateau_mean/intrinsic_friction,")
    assert lines[1].startswith("0.25,50,0.5,")
    assert len(lines) == 1 + dataset.plateau_mean.size


def test_cases_are_chosen_by_their_values_and_a_picture_has_the_size_and_style_that_are_asked_for(
    main, tmp_path, dataset
):
    (tmp_path / "mine.mplstyle").write_text("lines.linewidth: 3.25\n", "utf-8")
    look = ("--size", 3.3, 2.4, "--style", tmp_path / "mine.mplstyle", "-o", target := tmp_path / "fig.svg", "--csv")
    code, said, _ = main("figure", tmp_path, "mu_i=0.5", "radius=50,200", "--y", "plateau", *look)
    assert (code, "Of intrinsic_friction = 0.5, radius = 50,200." in said) == (0, True)
    rows = [line.split(",")[:2] for line in target.with_suffix(".csv").read_text("utf-8").splitlines()]
    assert rows == [["radius", "plateau_mean"], ["50", "0.25"], ["200", "0.25"]]
    text = target.read_text("utf-8")
    assert 'width="237.6pt" height="172.8pt"' in text  # 72 points an inch
    assert "stroke-width: 3.25" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("{} --y plateau radius=70", "radius = 70: no such case; there are 50, 100, 200"),
        ("{} --y plateau radius=50 mu_i=0.5", "plateau_mean: all cases are alike: there is nothing to draw it against"),
        ("{} --y plateau --size 3", "Option '--size' requires 2 arguments"),
        ("{} --y plateau --size 3 60", "60.0 is not in the range 0.5<=x<=50.0"),
        ("{} --y plateau --style no.mplstyle", "no.mplstyle: no style sheet: needs a file, or one of "),
        ("{} --y plateau/foo", "foo: no variable of this dataset"),
        ("{} --y plateau --x outcome", "outcome: cases do not differ in it; they differ in intrinsic_friction (μ_i), "
         "radius (R/L_x)"),
        ("{} --y plateau -o fig.jpg", "fig.jpg: needs a name that ends in .pdf, .svg, .png"),
        ("{} other --y plateau", "other: needs key=value, as radius=50"),
        ("--y plateau", "--y plateau: needs one campaign, or a dataset (results.nc)"),
        ("{} --x radius", "need --y, the number that is drawn"),
        ("{} --y outcome/plateau_mean", "a ratio needs two numbers, and one of these is words"),
        ("fig12", "fig12: no figure; there are "),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_refused_in_one_line(main, tmp_path, monkeypatch, dataset, words, message):
    monkeypatch.chdir(tmp_path)
    code, _, said = main("figure", *words.format(tmp_path).split())
    assert (code, message in said, list(tmp_path.iterdir())) == (2, True, [])


def test_frames_are_of_the_case_that_is_singled_out(main, campaign, tmp_path):
    words = ("intrinsic_friction=0.5", "radius=50", "--events", "0,20", "-o", tmp_path / "strip.svg")
    code, out, err = main("frames", campaign, *words)
    assert (code, err) == (0, "")
    assert f"written: {tmp_path / 'strip.svg'} (intrinsic_friction = 0.5, radius = 50, " in out
    assert "2 moments to event 20)" in out
    assert "<svg" in (tmp_path / "strip.svg").read_text()


def test_frames_that_the_record_does_not_reach_are_named(main, campaign, tmp_path):
    campaign.write_text('title = "short"\nconstants.radius = 50.0\nnumerics.n_x = 17\nlimits.displacement = 1e-5\n')
    code, _, err = main("frames", campaign, "--events", "0,1000", "-o", tmp_path / "strip.svg")
    assert (code, err.partition(":")[0], "(completed)" in err) == (0, "no event 1000", True)


@pytest.mark.parametrize("words", ["radius=1", "radius=50", "-o a.jpg", "--events x"])
def test_what_is_wrong_with_frames_is_one_line_and_nothing_is_written(main, campaign, words):
    assert not one_line(main("frames", campaign, *words.split()), "Error: ")
    assert list(campaign.parent.iterdir()) == [campaign]
