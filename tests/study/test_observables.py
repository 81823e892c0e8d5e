"""One's own numbers of records and drives: values, meaning, keys, errors, and who executes the user's file."""

import hashlib
import math
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import nanoslip
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study import api
from nanoslip.study.dataset.variables import own_numbers
from nanoslip.study.figures.points import read_points
from nanoslip.study.manifest.observables import explain_docstring
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.report.single_case import case_table
from nanoslip.study.report.summary import cautions, scalar_table
from nanoslip.study.tasks.functions import evaluate, read_functions
from nanoslip.study.tasks.kind import OWN
from tests.conftest import Command, Main

CAMPAIGN = """\
title = "One's own numbers"

[axes]
radius = [50.0, 100.0]

[numerics]
n_x = 17

[limits]
events = 200

[ensemble]
members = 3

[[drives]]
duration = 0.02
samples = 20

[outputs]
fit = false
observables = ["mine:largest_drop", "mine:own_steps", "mine:fails", "mine:is_text", "mine:leaves", "mine:grows"]
"""
MEANING, COMMENT = "Largest drop of F/W", "At an event, of all events of a start."
"""Words of the docstring of `largest_drop`."""
MINE = '''\
"""Numbers of my own."""

from pathlib import Path

import numpy as np

if Path(__file__).with_name("watch").exists():
    Path(__file__).with_name("executed").touch()


def largest_drop(record):
    """Largest drop of F/W.

    At an event, of all
    events of a start.
    """
    return np.max(record.force_before - record.force_after) / record.normal_load


def own_steps(record, motion, share=1.0):
    return share * motion.steps


def fails(record):
    raise RuntimeError(object())


def is_text(record):
    return "many"


def leaves(record):
    raise SystemExit


def grows(record):
    return np.inf
'''
FAILING = ("fails", "is_text", "leaves", "grows")


def write(folder: Path, mine: str = MINE, campaign: str = CAMPAIGN) -> Path:
    """Write the campaign and its file of functions into a folder."""
    folder.mkdir(exist_ok=True)
    (folder / "mine.py").write_text(mine)
    path = folder / "own.toml"
    path.write_text(campaign)
    return path


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the campaign and, in `out`, its results; computed in this process."""
    folder = tmp_path_factory.mktemp("own")
    api.run(write(folder), folder / "out", progress=False).close()
    return folder


def largest_drop(record: FrictionRecord) -> float:
    """Drop of F/W."""
    return float(np.max(record.force_before - record.force_after) / record.normal_load)


@pytest.mark.slow
def test_a_number_and_its_uncertainty_are_those_of_the_members(computed: Path) -> None:
    with nanoslip.open(computed / "out") as data:
        for radius in (50.0, 100.0):
            values = [largest_drop(each) for each in nanoslip.records(computed / "own.toml", radius=radius)]
            mean, case = nanoslip.mean_of(values), data.sel(radius=radius).squeeze()
            assert case["largest_drop"].item() == mean.mean > 0.0
            assert case["largest_drop_uncertainty"].item() == pytest.approx(mean.uncertainty, rel=1e-14)
            assert case["largest_drop_members"].item() == 3
        # The same number as one that drives have by themselves.
        np.testing.assert_array_equal(data["own_steps"], data["steps"])
        assert data["own_steps"].dims == data["drive_outcome"].dims


def test_a_docstring_is_the_meaning_and_the_source_is_named_by_its_hash(computed: Path) -> None:
    with nanoslip.open(computed / "out") as data:
        told = data["largest_drop"].attrs
        assert told["long_name"] == MEANING
        assert told["comment"] == COMMENT
        assert told["source"] == f"mine:largest_drop, SHA-256 {hashlib.sha256(MINE.encode()).hexdigest()}"
        assert data["own_steps"].attrs["long_name"] == "own steps"
        assert data.attrs["manifest_observables"] == MINE


@pytest.mark.parametrize(
    ("docstring", "meaning", "unit"),
    [
        ("Largest drop of F [mN].", "Largest drop of F", "mN"),
        ("Rise of the force [N/m]\n\nAfter a turn.", "Rise of the force", "N/m"),
        ("Largest drop, as defined before [see note]", "Largest drop, as defined before [see note]", ""),
        (None, "largest drop", ""),
    ],
)
def test_brackets_behind_a_meaning_are_its_unit(docstring: str | None, meaning: str, unit: str) -> None:
    explained = explain_docstring(docstring, "largest_drop")
    assert (explained.meaning, explained.unit) == (meaning, unit)


def test_an_exception_costs_its_number_alone(computed: Path) -> None:
    with nanoslip.open(computed / "out") as data:
        assert set(np.ravel(data["outcome"])) == {"completed"}
        assert not any(np.ravel(data["message"]))
        for name in FAILING:
            assert data[name].isnull().all()
        messages = np.ravel(data["observables_message"])
        assert all(f"{name}: " in message for name in FAILING for message in messages)
        # No address of an object, which differs from process to process; and the line of the file.
        line = 1 + MINE.splitlines().index("    raise RuntimeError(object())")
        assert f"RuntimeError: <object object at 0x…> (mine.py, line {line})" in messages[0]
        assert not any(np.ravel(data["drive_observables_message"]))


def test_members_without_a_number_are_counted_and_nan_is_no_error() -> None:
    """A function's NaN says that there is none; a member without a record is not asked."""
    inverse = read_functions({"inverse": lambda x: 1.0 / x if x < 9.0 else math.nan}, apart=False)
    found = evaluate(inverse, [(2.0,), (0.0,), (np.float32(4.0),), (10.0,), None])
    np.testing.assert_array_equal(found.scalars["inverse"], [0.5, math.nan, 0.25, math.nan, math.nan])
    assert found.outcome.ok
    assert "ZeroDivisionError" in found.outcome.message
    assert "1 of 5" in found.outcome.message
    assert not evaluate(inverse, [None]).outcome.message


def test_tables_show_them(computed: Path) -> None:
    with nanoslip.open(computed / "out") as data:
        assert own_numbers(data) == ["largest_drop", *FAILING, "own_steps"]
        table = scalar_table(data)
        assert {"largest drop", "own steps"} <= set(table.header[table.labels : table.labels + table.asked])
        rows, _ = case_table(data.isel(radius=0).squeeze())
        assert ("largest_drop", MEANING) in [(row[0], row[2]) for row in rows.rows]
        assert any("is_text: " in line and "2 of 2" in line for line in cautions(data))


def test_a_figure_has_its_meaning_and_uncertainty(computed: Path) -> None:
    with nanoslip.open(computed / "out") as data:
        points = read_points(data, "largest_drop")
        assert points.label == MEANING
        np.testing.assert_array_equal(points.errors, np.ravel(data["largest_drop_uncertainty"]))
        assert (points.errors > 0.0).all()


def test_a_changed_function_is_evaluated_anew_over_the_same_records(tmp_path: Path) -> None:
    first = make_plan(load_manifest(write(tmp_path)))
    second = make_plan(load_manifest(write(tmp_path, MINE.replace("np.max(", "2.0 * np.max("))))
    without = make_plan(load_manifest(write(tmp_path, campaign=CAMPAIGN.partition("observables")[0])))
    keys = [{task.key: task.kind for task in plan.distinct} for plan in (first, second, without)]
    assert {keys[0][key] for key in keys[0].keys() - keys[1].keys()} == {*OWN}
    assert keys[0].keys() & keys[1].keys() == keys[2].keys()


@pytest.mark.slow
def test_a_run_that_is_resumed_and_one_of_two_processes_give_the_same_bytes(computed: Path, tmp_path: Path) -> None:
    """After another function in the same folder, of which nothing is left but results."""
    one, other = tmp_path / "one", tmp_path / "other"
    api.run(write(one, MINE.replace("np.max(", "2.0 * np.max(")), one / "out", progress=False).close()
    doubled = api.run(one / "own.toml", one / "out", progress=False)["largest_drop"].load()
    api.run(write(one, MINE), one / "out", progress=False).close()
    api.run(write(other, MINE), other / "out", progress=False, jobs=2).close()
    assert (one / "out/results.nc").read_bytes() == (other / "out/results.nc").read_bytes()
    with nanoslip.open(one / "out") as data:
        np.testing.assert_array_equal(2.0 * data["largest_drop"], doubled)


@pytest.mark.slow
def test_three_ranks_give_the_same_bytes(nanoslip: Command, tmp_path: Path) -> None:
    campaign = write(tmp_path, MINE)
    for ranks, out in ((3, "ranks"), (0, "alone")):
        done = nanoslip("run", campaign, "--out", tmp_path / out, ranks=ranks)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "ranks/results.nc").read_bytes() == (tmp_path / "alone/results.nc").read_bytes()


@pytest.mark.slow
def test_who_reads_executes_nothing(computed: Path, tmp_path: Path, main: Main) -> None:
    """The file of a stranger leaves a mark where it is executed."""
    folder = shutil.copytree(computed, tmp_path / "strange")
    (folder / "watch").touch()
    campaign, out = folder / "own.toml", folder / "out"
    for command in ("status", "report", "collect", "plan", "export"):
        assert main(command, campaign, "--out", out)[0] == 0, command
    assert main("show", campaign, "radius=50", "--out", out)[0] == 0
    code, text, _ = main("verify", out, "--sample", "1")
    assert code == 0
    assert "not judged: largest_drop" in text
    assert not (folder / "executed").exists()
    # A module is executed once in a process: another text is another module.
    campaign = write(folder, f"{MINE}\n")
    assert main("check", campaign)[0] == 0
    assert (folder / "executed").exists()


BAD = {
    '["mine:largest_drop", "mine:largest_drop"]': "twice",
    '["mine.largest_drop"]': "largest_drop",
    '["mine:largest_drops"]': "did you mean largest_drop?",
    '["mine:FAILING"]': "def FAILING(record)",
    '["mine:three"]': "def three(record, motion)",
    '["mine:needs_word"]': "def needs_word(record)",
    '["hers:drop"]': "hers.py beside this file",
    '["broken:drop"]': "line 1",
    '"mine:largest_drop"': "a list",
    "[1]": "a list",
    "0": "a list",
}


@pytest.mark.parametrize("given", BAD)
def test_bad_references_are_refused_with_what_is_allowed(given: str, tmp_path: Path) -> None:
    extra = "\ndef three(a, b, c): ...\ndef needs_word(record, *, word): ...\nFAILING = 1\n"
    campaign = write(tmp_path, MINE + extra, f"{CAMPAIGN.partition('observables')[0]}observables = {given}\n")
    (tmp_path / "broken.py").write_text("def drop(record:\n")
    with pytest.raises(ManifestError) as refused:
        load_manifest(campaign)
    (problem,) = refused.value.problems
    assert (problem.place.part, problem.key) == ("outputs", "observables")
    assert BAD[given] in problem.need


@pytest.mark.parametrize(
    ("stages", "named"),
    [('["contact"]', {"mine:largest_drop", "mine:own_steps"}), ('["contact", "slip"]', {"mine:own_steps"})],
)
def test_a_number_without_its_stage_is_refused(stages: str, named: set[str], tmp_path: Path) -> None:
    observables = 'observables = ["mine:largest_drop", "mine:own_steps"]'
    text = f"stages = {stages}\n{CAMPAIGN.partition('observables')[0]}{observables}\n"
    with pytest.raises(ManifestError) as refused:
        load_manifest(write(tmp_path, campaign=text))
    assert {problem.value for problem in refused.value.problems} == named


@pytest.mark.parametrize("name", ["peak_friction", "radius", "record", "event", "largest_drop_members"])
def test_a_name_that_a_dataset_has_is_refused(name: str, tmp_path: Path) -> None:
    mine = f"{MINE}\ndef {name}(record):\n    return 0.0\n"
    text = f'{CAMPAIGN.partition("observables")[0]}observables = ["mine:largest_drop", "mine:{name}"]\n'
    with pytest.raises(ManifestError) as refused:
        api.run(write(tmp_path, mine, text), progress=False)
    assert [problem.value for problem in refused.value.problems] == [f"mine:{name}"]


@pytest.mark.parametrize("first", ["import helpers", "from helpers import drop", "import not_installed_at_all"])
def test_a_file_that_needs_another_or_does_not_load_is_refused_once_before_anything_is_computed(
    first: str, tmp_path: Path, main: Main
) -> None:
    campaign = write(tmp_path, f"{first}\n{MINE}")
    (tmp_path / "helpers.py").write_text("drop = 1\n")
    for command in ("check", "run"):
        code, _, errors = main(command, campaign)
        assert code == 2
        assert errors.count("outputs.observables") == 1
    assert not (tmp_path / "results").exists()


PLAIN = {
    "title": "Functions of Python",
    "axes": {"radius": [50.0, 100.0]},
    "numerics": {"n_x": 17},
    "limits": {"events": 60},
    "ensemble": {"members": 3},
}


@pytest.mark.slow
def test_python_takes_functions_and_a_changed_one_is_evaluated_anew(tmp_path: Path) -> None:
    found = []
    for factor in (1.0, 2.0):
        numbers = {"drop": lambda record: factor * largest_drop(record), "largest_drop": largest_drop}  # noqa: B023
        found.append(api.run(PLAIN, tmp_path / "out", observables=numbers, progress=False).load())
    np.testing.assert_array_equal(found[0]["drop"], found[0]["largest_drop"])
    np.testing.assert_array_equal(found[1]["drop"], 2.0 * found[0]["drop"])
    assert found[0]["largest_drop"].attrs["long_name"] == "Drop of F/W"
    assert found[0]["largest_drop_uncertainty"].notnull().all()
    assert own_numbers(api.run(PLAIN, tmp_path / "out", progress=False)) == []


@pytest.mark.slow
def test_other_processes_import_functions_from_their_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_numbers_of_a_test.py").write_text(MINE)
    monkeypatch.syspath_prepend(str(tmp_path))
    module = __import__("own_numbers_of_a_test")
    monkeypatch.setitem(sys.modules, "own_numbers_of_a_test", module)
    numbers = {"drop": module.largest_drop}
    apart = api.run(PLAIN, observables=numbers, jobs=2, progress=False)
    mean = nanoslip.mean_of([largest_drop(each) for each in nanoslip.records(PLAIN, radius=50.0)])
    assert apart["drop"].sel(radius=50.0).item() == mean.mean > 0.0


@pytest.mark.parametrize(
    ("numbers", "jobs"),
    [
        ({"drop": lambda record: 0.0}, 2),
        ({"drop": max}, 1),
        ({"no name": largest_drop}, 1),
        ({"drop": lambda: 0.0}, 1),
        ({"drop": eval("lambda record: 0.0", {"__name__": "nowhere"})}, 1),
        ({"drop": lambda record, motion: 0.0}, 1),  # without drives
    ],
)
def test_functions_that_cannot_be_known_or_called_are_refused(numbers: api.Observables, jobs: int) -> None:
    with pytest.raises(InvalidInput) as refused:
        api.run(PLAIN, observables=numbers, jobs=jobs, progress=False)
    assert refused.value.key.startswith("observables")
    assert refused.value.need
