"""A campaign computed from Python is the command's campaign: same dataset, same messages, resumed in the same folder."""

import io
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import rich.console
import xarray as xr

import nanoslip
from nanoslip.study import api
from nanoslip.study.api import fit, open as open_dataset, run
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.results import entry as own
from nanoslip.study.results.store import FOLDER
from nanoslip.study.run import campaign as run_of_campaign, executor
from nanoslip.study.run.launch import Program
from nanoslip.study.tasks.compute import run_task
from tests.conftest import SMALL, THREADS
from tests.study.run import faults
from tests.study.run.defects import crashing


def test_the_records_of_all_members_begin_with_the_one_in_the_dataset():
    campaign = {
        "title": "peaks",
        "axes": {"radius": [50.0, 100.0]},
        "numerics": {"n_x": 17},
        "limits": {"events": 60},
        "ensemble": {"members": 3},
    }
    data, found = run(campaign), nanoslip.records(campaign, radius=50.0)
    first, peaks = data.nanoslip.record(radius=50.0), [record.highest_force / record.normal_load for record in found]
    np.testing.assert_array_equal(found[0].friction_before, first.event_force_before)
    np.testing.assert_array_equal(found[0].friction_after, first.event_force_after)
    mean = nanoslip.mean_of(peaks)
    assert first.peak_friction.item() == mean.mean == pytest.approx(sum(peaks) / 3, rel=1e-15)
    assert mean.uncertainty == pytest.approx(
        1.3212 * np.std(peaks, ddof=1) / 3**0.5, rel=1e-4
    )  # Student's t of two, 68.27 %
    assert "first member" in data.nanoslip.tree["record"]["record"].attrs["comment"]
    with pytest.raises(ValueError, match="2 cases"):
        nanoslip.records(campaign)
    with pytest.raises(KeyError, match="radus"):
        nanoslip.records(campaign, radus=50.0)
    with pytest.raises(KeyError, match="no case"):
        nanoslip.records(campaign, radius=51.0)


TINY = {
    "title": "tiny",
    "axes": {"normal_load": [1e-3, 2e-3]},
    "numerics": {"n_x": 17},
    "limits": {"events": 20},
    "ensemble": {"members": 1},
}


def numbers(dataset: xr.Dataset) -> xr.Dataset:
    """Without the attributes, which quote the campaign file."""
    return dataset.drop_attrs()


@pytest.mark.slow
def test_a_file_and_a_dict_give_the_dataset_of_the_command(computed, campaign):
    with open_dataset(computed) as expected:
        xr.testing.assert_identical(run(campaign), expected.load())
        xr.testing.assert_identical(numbers(run(tomllib.loads(SMALL))), numbers(expected.load()))


@pytest.mark.slow
def test_a_folder_is_resumed_and_read_from(tmp_path, monkeypatch):
    out = tmp_path / "out"
    with run(TINY, out) as first:
        assert first.outcome.values.ravel().tolist() == ["no_plateau", "no_plateau"]
    stamps = {path: path.stat().st_mtime_ns for path in (out / FOLDER).iterdir()}
    monkeypatch.setattr(executor, "run_task", None)  # nothing is computed
    with run(TINY, str(out)) as again, open_dataset(out / "results.nc") as opened:
        xr.testing.assert_identical(again.load(), opened.load())
    assert {path: path.stat().st_mtime_ns for path in (out / FOLDER).iterdir()} == stamps


@pytest.mark.slow
@pytest.mark.parametrize("cut", [lambda found: found, lambda found: found.isel(normal_load=[1])], ids=["all", "a part"])
def test_datasets_are_pickled_with_their_records(tmp_path, cut):
    """As joblib and dask.distributed send them to other processes."""
    with run(TINY, tmp_path) as found:
        part = cut(found)
        again = pickle.loads(pickle.dumps(part))  # before its values are read: from the file
        xr.testing.assert_identical(again.nanoslip.tree.load(), part.nanoslip.tree.load())
        xr.testing.assert_identical(again.nanoslip.record(normal_load=2e-3), part.nanoslip.record(normal_load=2e-3))
        again.close()
    copied = pickle.loads(pickle.dumps(run(TINY)))  # in memory
    assert copied.nanoslip.events().sizes["event"] == 40


def test_a_campaign_goes_by_name(monkeypatch, tmp_path):
    (tmp_path / "mine.toml").write_text('title = "mine"\nstages = ["contact"]\nnumerics.n_x = 17\n')
    monkeypatch.setattr(api.shipped, "folder", lambda _: tmp_path)
    assert run("mine").attrs["title"] == "mine"


def test_files_that_a_dict_names_are_looked_for_in_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("cases.csv").write_text("normal_load,radius\n1e-3,100\n2e-3,50\n")
    document = {"title": "table", "stages": ["contact"], "table": "cases.csv", "numerics": {"n_x": 17}}
    np.testing.assert_array_equal(run(document).radius, [100.0, 50.0])
    with pytest.raises(ManifestError, match=r"none\.csv: "):
        run(document | {"table": "none.csv"})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": {"radius": [-50.0]}}, "campaign: axes.radius[0] = -50.0: needs 1e-12 ≤ radius"),
        ({"numerics": {"n_y": 5}}, "campaign: numerics.n_y = 5: unknown; did you mean n_x?"),
        ({"axes": {"radius": [1j]}}, "campaign: axes.radius[0] = 1j: needs a text, a number"),
    ],
)
def test_what_is_wrong_with_a_dict_is_named(change, message):
    with pytest.raises(ManifestError) as caught:
        run(TINY | change)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("given", ['title = "A text"\n' * 30, "a" * 5000, "a\0b"])
def test_what_can_be_no_name_of_a_file_is_refused(given):
    for ask in (run, nanoslip.records):
        with pytest.raises(ManifestError):
            ask(given)


def test_a_task_that_crashes_is_a_warning_and_an_outcome_until_it_is_tried_again(monkeypatch, capsys, tmp_path):
    defective = crashing(lambda task: task.kind == "record" and task.case.normal_load == 2e-3)
    monkeypatch.setattr(executor, "run_task", defective)
    with pytest.warns(RuntimeWarning, match="1 tasks failed"):
        data = run(TINY, tmp_path)
    assert data.outcome.values.ravel().tolist() == ["no_plateau", "crashed"]
    assert "RuntimeError: a defect" in data.message.values.ravel().tolist()[1]
    assert "a defect" in capsys.readouterr().err
    monkeypatch.setattr(executor, "run_task", run_task)
    with pytest.warns(RuntimeWarning, match="1 tasks failed"):
        assert run(TINY, tmp_path).outcome.values.ravel().tolist() == ["no_plateau", "crashed"]
    assert run(TINY, tmp_path, retry=True).outcome.values.ravel().tolist() == ["no_plateau", "no_plateau"]


@pytest.mark.slow
def test_the_death_of_a_process_costs_one_task(monkeypatch, tmp_path):
    faulty = lambda out: Program(faults.__name__, "campaign_executor", (out, {2e-3: "kill -9"}))  # noqa: E731
    monkeypatch.setattr(api, "task_program", faulty)
    contacts = {"title": "contacts", "stages": ["contact"], "numerics": {"n_x": 17}}
    contacts["axes"] = {"normal_load": [1e-3, 2e-3, 3e-3]}
    with pytest.warns(RuntimeWarning, match="1 tasks failed"):
        data = run(contacts, jobs=2)
    assert data.outcome.values.ravel().tolist() == ["completed", "crashed", "completed"]
    assert "died of signal 9" in data.message.values.ravel().tolist()[1]


def test_less_than_one_process_is_refused(tmp_path):
    with pytest.raises(ValueError, match="jobs = 0: "):
        run(TINY, tmp_path / "out", jobs=0)
    assert not (tmp_path / "out").exists()


def test_an_interrupted_run_keeps_what_is_finished_and_raises(monkeypatch, tmp_path):
    compute = executor.run_task

    def interrupted(task, inputs):
        if task.kind == "record" and task.cost > 0.0:  # a plan's, no miniature that compiles kernels
            raise KeyboardInterrupt
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(TINY, tmp_path)
    assert len(list((tmp_path / FOLDER).glob(f"*{own.ENDING}"))) == 1  # the compliance


def test_what_does_not_fit_the_memory_is_refused(monkeypatch):
    monkeypatch.setattr(run_of_campaign, "shortages", lambda *_: ["a task needs about 1e9 GB of memory"])
    with pytest.raises(MemoryError, match="1e9 GB"):
        run(TINY)


THREADED = """
import hashlib, sys
from pathlib import Path
import nanoslip
for jobs in map(int, sys.argv[2:]):
    out = Path(sys.argv[1], str(jobs))
    nanoslip.run({**%r, "numerics": {"n_x": 65}}, out=out, progress=False, jobs=jobs)
    print(hashlib.sha256((out / "results.nc").read_bytes()).hexdigest())
"""


@pytest.mark.slow
def test_the_bits_are_those_of_one_thread_whatever_the_environment(tmp_path, environment):
    """Each in an interpreter of its own, as a library of linear algebra reads the environment when it is loaded."""

    digests = set()
    for threads, jobs in {"1": "1", "4": "12"}.items():
        program = (sys.executable, "-c", THREADED % TINY, str(tmp_path / threads), *jobs)
        given = environment | dict.fromkeys(THREADS, threads)
        done = subprocess.run(program, env=given, check=True, capture_output=True, text=True)
        digests |= set(done.stdout.split())
    assert len(digests) == 1


WATCHED = {"pipe": {}, "terminal": {"force_terminal": True}, "notebook": {"force_jupyter": True}}


@pytest.mark.parametrize("place", WATCHED)
def test_progress_is_shown_where_somebody_watches(monkeypatch, capsys, place):
    seen = io.StringIO()
    screen = rich.console.Console(file=seen, **WATCHED[place])
    monkeypatch.setattr(api, "console", lambda stderr: screen)
    contact = {"title": "x", "stages": ["contact"], "numerics": {"n_x": 17}}
    run(contact)
    said = seen.getvalue() + capsys.readouterr().err
    assert ("tasks" in said) == (place != "pipe")
    run(contact, progress=False)
    assert seen.getvalue() + capsys.readouterr().err in said


def test_progress_is_printed_when_asked_for(capsys):
    run(TINY, progress=True)
    assert "3 of 3 tasks done" in capsys.readouterr().err


def test_a_rank_of_several_is_told_that_it_computes_all_by_itself(monkeypatch):
    monkeypatch.setenv("PMI_SIZE", "4")
    told = "one of 4 ranks computes all of it itself: .* with comm=MPI.COMM_WORLD"
    campaign = {"title": "x", "stages": ["contact"], "numerics": {"n_x": 129}}
    with pytest.warns(RuntimeWarning, match=told):
        run(campaign, progress=False)
    with pytest.warns(RuntimeWarning, match=told):
        fit(campaign, {"contact_half_width": (0.15, 0.01)}, {"radius": (20.0, 40.0)}, points=16, progress=False)
    with pytest.raises(ValueError, match="jobs = 1, out = None"):
        run(campaign, comm=object())  # type: ignore[call-overload]


def test_a_range_and_a_frame_of_pandas_are_an_axis_and_a_table() -> None:
    small = {"title": "x", "stages": ["contact"], "ensemble": {"members": 1}}
    strip = {**small, "numerics": {"scheme": "strip"}}
    along = nanoslip.run({**strip, "axes": {"n_x": range(17, 34, 16)}})
    assert along["n_x"].values.tolist() == [17, 33]
    listed = nanoslip.run({**small, "numerics": {"n_x": 17}, "table": pd.DataFrame({"radius": [50.0, 0.1 + 0.2]})})
    assert listed["radius"].values.tolist() == [50.0, 0.1 + 0.2]


def test_studies_with_unlike_outputs_join_by_their_scalars_alone() -> None:
    """Without that word they are refused; the datasets themselves keep their groups."""
    small = {"title": "x", "stages": ["contact", "slip"], "ensemble": {"members": 1}, "numerics": {"n_x": 17}}
    one = nanoslip.run({**small, "axes": {"radius": [50.0]}, "limits": {"events": 50}})
    other = nanoslip.run(
        {**small, "axes": {"radius": [100.0]}, "limits": {"events": 50}, "outputs": {"records": False}}
    )
    with pytest.raises(ValueError, match="scalars=True"):
        nanoslip.concat([one, other])
    both = nanoslip.concat([one, other], scalars=True)
    assert both.peak_friction.sel(radius=100.0).item() == other.peak_friction.item()
    assert both.sizes["radius"] == 2
    assert one.nanoslip.record().sizes["event"] > 0
    with pytest.raises(ValueError, match="scalars=True"):
        both.nanoslip.record(radius=50.0)


@pytest.mark.slow
def test_an_outer_join_of_scalars_keeps_those_that_only_one_study_has() -> None:
    small = {"title": "x", "ensemble": {"members": 1}, "numerics": {"n_x": 17}, "limits": {"events": 300}}
    drives = [{"name": name, "stage_velocity": v, "duration": 1e-3} for name, v in (("slow", 1e-3), ("fast", 1e-2))]
    driven = nanoslip.run({**small, "axes": {"radius": [50.0]}, "drives": drives})
    bare = nanoslip.run({**small, "axes": {"radius": [100.0]}, "stages": ["contact", "slip"]})
    for parts in ([driven, bare], [bare, driven]):
        both = nanoslip.concat(parts, "outer", scalars=True)
        assert both.steps.sel(radius=50.0).values.ravel().tolist() == driven.steps.values.ravel().tolist()
        assert (both.steps.notnull().sum(), both.sizes["drive"]) == (2, 2)
        assert both.peak_friction.sel(radius=100.0).item() == bare.peak_friction.item()
        assert "steps" not in nanoslip.concat(parts, scalars=True)


def test_every_key_of_axes_is_a_dimension_and_lengths_and_loads_are_in_si_where_scales_are_given() -> None:
    """An axis of one value was a coordinate without a dimension, which `xr.merge` gave to all values."""
    campaign = {
        "title": "x",
        "stages": ["contact"],
        "ensemble": {"members": 1},
        "numerics": {"n_x": 17},
        "axes": {"normal_load": [1e-3]},
    }
    found = nanoslip.run(campaign)
    assert ("normal_load" in found.contact_half_width.dims, "normal_load_si" in found.coords) == (True, False)
    given = nanoslip.run({**campaign, "scales": {"slab_width": "2 mm", "shear_modulus": "1 MPa"}})
    assert given.normal_load_si.dims == ("normal_load",)
    assert (given.normal_load_si.item(), given.normal_load_si.units) == (pytest.approx(1e-3 * 1e6 * 2e-3 * 1e-2), "N")
    assert (given.radius_si.item(), given.radius_si.units) == (pytest.approx(0.4), "m")


@pytest.mark.parametrize(
    ("wrong", "needed"),
    [
        (lambda: nanoslip.concat("results/mine"), "list"),  # type: ignore[arg-type]
        (lambda: nanoslip.run(TINY, jobs="2"), "jobs = '2': needs a whole number"),  # type: ignore[call-overload]
        (lambda: nanoslip.figure("results/mine", "mu_s"), r"nanoslip\.open"),  # type: ignore[arg-type]
        (lambda: nanoslip.open("mine.toml"), r"mine\.toml: .*results\.nc"),
    ],
)
def test_an_argument_of_another_kind_is_refused_with_what_is_needed(wrong, needed) -> None:
    with pytest.raises((TypeError, ValueError, nanoslip.StoreError), match=needed):
        wrong()
