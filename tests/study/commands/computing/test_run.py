"""A run computes what is not finished, keeps what it can, and names what other software computed; refused cases are results."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import xarray as xr

import nanoslip as nanoslip_here
from nanoslip.study.commands import datasets
from nanoslip.study.origin import here
from nanoslip.study.results import entry as own
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run import executor
from nanoslip.study.run import executor as failures
from nanoslip.study.run.compute import run_task
from tests.conftest import PARTLY_REFUSED, SMALL
from tests.study.results.results import as_clients, written
from tests.study.run.defects import crashing_at


def test_from_plan_to_report(main, campaign):
    out = campaign.parent / "out"
    code, said, _ = main("plan", campaign)
    assert (code, "4 cases" in said) == (0, True)
    code, said, progress = main("run", campaign, "--out", out, "--serial")
    assert code == 0
    assert "completed" in said
    assert f"dataset: {out / 'results.nc'}" in said
    assert "13 of 13 tasks done" in progress
    before = (out / "results.nc").read_bytes()
    stamps = {path: path.stat().st_mtime_ns for path in (out / "results").iterdir()}

    code, _, progress = main("run", campaign, "--out", out, "--serial")
    assert (code, "0 tasks to do" in progress) == (0, True)
    assert (out / "results.nc").read_bytes() == before
    assert {path: path.stat().st_mtime_ns for path in (out / "results").iterdir()} == stamps

    assert main("status", campaign, "--out", out)[0] == 0
    code, said, _ = main("report", campaign, "--out", out)
    assert (code, (out / "report.html").is_file()) == (0, True)
    assert "report.html" in said


def test_a_time_below_zero_to_finish_in_is_refused(main, campaign):
    code, said, errors = main("run", campaign, "--grace", "-1")
    assert (code, said) == (2, "")
    assert "-1.0 is not in the range x>=0.0" in " ".join(errors.split())
    assert not (campaign.parent / "out").exists()


def test_results_of_an_older_nanoslip_are_named_and_computed_again(main, campaign):
    out = campaign.parent / "out"
    (out / "results").mkdir(parents=True)
    (out / "results" / f"{1:020x}.npz").touch()
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, "1 of an older nanoslip, first 0000" in errors) == (0, True)


def disown(out: Path, every: int) -> set[str]:
    """Make every so-manieth result another software's; returns the files."""
    store, changed = Store(out), set()
    for key in sorted(store.finished())[::every]:
        result = store.read(key)
        other = replace(result, origins=(replace(here(), source_hash="0ther", source_commit="c0ffee"),))
        store.write(other, shared=own.path_of(store.folder, key).exists())
        changed.add(key)
    return changed


def test_files_of_others_among_the_results_stay_and_results_of_another_format_are_refused(main, campaign):
    out = campaign.parent / "out"
    results = out / "results"
    results.mkdir(parents=True)
    (results / "notes.log").write_text("what I did on Monday")
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert (results / "notes.log").read_text() == "what I did on Monday"
    log, own_file = next(results.glob("0*.log")), next(results.glob(f"*{own.ENDING}"))
    for path in (log, own_file):
        ours = path.read_bytes()
        newer = b"nslip 2\n" + bytes(len(ours))
        path.write_bytes(newer)
        for command in (("run", "--serial"), ("collect",), ("status",)):
            code, _, errors = main(command[0], campaign, "--out", out, *command[1:])
            assert (code, errors.count(f"{path.name}: has format 2, of another nanoslip")) == (2, 1)
        assert path.read_bytes() == newer
        path.write_bytes(ours)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0


def test_results_of_other_software_are_named_and_computed_again_when_asked(main, campaign, finished):
    out = finished
    for command in ("plan", "status"):
        assert "other software's" not in main(command, campaign, "--out", out)[1]
    before = (out / "results.nc").read_bytes()
    changed = disown(out, every=3)
    kept = written(out)
    for command in ("plan", "status"):
        code, said, _ = main(command, campaign, "--out", out)
        assert code == 0
        assert f"{len(changed)} finished results are other software's: {len(changed)} of nanoslip" in said
        assert "source 0ther, commit c0ffee" in said
        assert f"nanoslip run {campaign} --out {out} --recompute-foreign" in said

    code, said, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, "0 tasks to do" in errors, "source 0ther" in errors) == (0, True, True)
    assert "results of different software: " in said
    with xr.open_dataset(out / "results.nc") as found:
        assert "of nanoslip" in found.attrs["mixed_software"]
    assert "results of different software: " in main("collect", campaign, "--out", out)[1]

    code, said, errors = main("run", campaign, "--out", out, "--serial", "--recompute-foreign")
    assert (code, "different software" in said) == (0, False)
    assert f"{len(changed)} results of other software" in errors
    assert (out / "results.nc").read_bytes() == before
    assert (written(out) - kept).keys() <= changed  # nothing else was computed again


def test_records_that_nobody_wants_are_gone_after_the_run(main, campaign):
    out = campaign.parent / "out"
    campaign.write_text(SMALL + "[outputs]\nrecords = false\ntrajectory = false\n")
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert len(written(out)) == 1 + 4 + 8  # the compliance, scalars of records and of drives
    assert sum(path.stat().st_size for path in (out / "results").glob("*.log")) < 5_000 * 12
    code, said, progress = main("run", campaign, "--out", out, "--serial")
    assert (code, "0 tasks to do" in progress) == (0, True)
    # One slow stage never gets the pin to slip, another so late that its mean force says nothing yet.
    # Each failure is in a row, and once more with its advice.
    assert [said.count(ending) for ending in ("completed", "no_slip", "no_plateau")] == [7, 2, 2]
    assert [said.count(f"{ending}: 1 of 8 drives") for ending in ("no_slip", "no_plateau")] == [1, 1]


def test_cases_that_physics_refuses_are_results_and_exit_code_0(main, campaign):
    campaign.write_text(PARTLY_REFUSED)
    code, said, _ = main("plan", campaign)
    assert (code, "16 cases, 4 of them refused" in said) == (0, True)
    code, said, _ = main("run", campaign, "--out", campaign.parent / "out", "--serial")
    assert code == 0
    assert "invalid: 4 of 16 cases, first " in said
    assert ": rows = 5: needs 3 to 4 rows at n_x = 9" in said


def test_a_task_that_crashes_is_an_outcome_and_exit_code_3_until_it_is_tried_again(main, campaign, monkeypatch):
    monkeypatch.setattr(executor, "run_task", crashing_at("record", 100.0))
    out = campaign.parent / "out"
    code, said, errors = main("run", campaign, "--out", out, "--serial")
    assert code == 3
    assert "6 tasks failed, or needed one that did" in errors  # two records and the two drives of each
    assert "RuntimeError: a defect" in errors
    assert [said.count(word) for word in ("completed", "no_slip", "crashed: 2 of 4 cases")] == [4, 2, 1]
    first = (out / "results.nc").read_bytes()
    monkeypatch.setattr(executor, "run_task", run_task)
    code, said, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, "6 tasks failed before" in errors) == (3, True)
    assert (out / "results.nc").read_bytes() == first
    said = main("status", campaign, "--out", out)[1]
    assert "6 tasks are not tried any more" in said
    code, said, errors = main("run", campaign, "--out", out, "--serial", "--retry")
    assert (code, "6 tasks left" in errors) == (0, True)
    assert [said.count(word) for word in ("completed", "no_slip", "crashed")] == [7, 2, 0]


DROPPED = SMALL + "[outputs]\nrecords = false\ntrajectory = false\n"


def test_what_was_tried_again_with_success_and_dropped_has_not_failed(main, campaign, monkeypatch):
    """Drives that are added later are computed, from a record that is computed for them once more."""
    campaign.write_text(DROPPED)
    out = campaign.parent / "out"
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        code, said, _ = main("run", campaign, "--out", out, "--serial")
    assert (code, "crashed: 2 of 4 cases" in said) == (3, True)  # of which the scalars alone are kept
    assert main("run", campaign, "--out", out, "--serial", "--retry")[0] == 0
    campaign.write_text(DROPPED + '[[drives]]\nname = "third"\nstage_velocity = 5e-3\nsamples = 40\n')
    code, said, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, "failed before" in errors, "pending" in said) == (0, False, False)


def test_a_drive_that_is_not_computed_is_never_completed(main, campaign, monkeypatch):
    """Its record failed, was computed in the next run, and that was interrupted before the drive."""
    out = campaign.parent / "out"
    with monkeypatch.context() as once:
        once.setattr(executor, "run_task", crashing_at("record", 100.0))
        assert main("run", campaign, "--out", out, "--serial")[0] == 3
    counted = json.loads(main("status", campaign, "--out", out, "--json")[1])
    assert counted["tasks"]["drive"] | {"core_seconds_left": 0, "memory_bytes": 0, "disk_bytes": 0} == {
        **{"all": 8, "finished": 4, "left": 0, "given_up": 4},
        **{"core_seconds_left": 0, "memory_bytes": 0, "disk_bytes": 0},
    }
    assert (counted["finished"], counted["drives"].get("crashed")) == (False, 4)  # as their cases
    full = Store.write

    def interrupted(store, result, shared):
        if result.kind == "drive":
            raise StoreError("no space")
        full(store, result, shared)

    with monkeypatch.context() as once:
        once.setattr(Store, "write", interrupted)
        assert main("run", campaign, "--out", out, "--serial", "--retry")[0] == 2
    counted = json.loads(main("status", campaign, "--out", out, "--json")[1])
    drives = counted["tasks"]["drive"]
    assert counted["drives"]["pending"] == drives["left"] > 0
    assert (
        counted["drives"]["crashed"] == drives["given_up"] == 4 - drives["left"]
    )  # of the record that was not reached
    assert main("run", campaign, "--out", out, "--serial", "--retry")[0] == 0


@pytest.mark.skipif(
    not Path("/proc/self/fd").exists(), reason="the made-up file system asks /proc for names of open files"
)
def test_what_processes_keep_until_their_logs_are_closed_is_in_the_dataset(nanoslip, main, campaign, tmp_path):
    out, alone = tmp_path / "out", tmp_path / "alone"
    assert main("run", campaign, "--out", alone, "--serial")[0] == 0
    done = nanoslip("run", campaign, "--out", out, "-j", "2", PYTHONPATH=as_clients(tmp_path))
    assert done.returncode == 0, done.stderr
    assert written(out) == written(alone)


def test_results_that_do_not_appear_are_named_and_exit_code_99(main, campaign, monkeypatch):
    """As where a node has lost what it had written."""
    out, keep = campaign.parent / "out", Store.write

    def lost(store, result, shared=False):
        if result.kind == "drive":
            return
        keep(store, result, shared)

    monkeypatch.setattr(failures, "VISIBLE", 0.1)
    monkeypatch.setattr(Store, "write", lost)
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert (code, errors.count("not there though they were computed: 8 of 13 results, first that of drive")) == (99, 1)
    with pytest.raises(StoreError, match="not there though they were computed: 8 of 8 results"):
        nanoslip_here.run(campaign, out)
    monkeypatch.setattr(Store, "write", keep)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0


def test_results_that_appear_later_are_waited_for(main, campaign, monkeypatch):
    """Clients of a network file system may show a folder as it was."""
    out, looks, metas = campaign.parent / "out", [], Store.metas

    def shown_later(store):
        looks.append(store)
        return metas(store) if len(looks) > 2 else {}

    monkeypatch.setattr(failures, "LOOK", 0.01)
    monkeypatch.setattr(Store, "metas", shown_later)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert len(looks) > 2


def test_a_result_that_comes_back_under_another_key_has_failed(main, campaign, monkeypatch):
    out = campaign.parent / "out"
    swapped = lambda task, inputs: replace(run_task(task, inputs), key=task.key[::-1])  # noqa: E731
    monkeypatch.setattr(executor, "run_task", lambda task, inputs: (swapped if task.drive else run_task)(task, inputs))
    code, said, _ = main("run", campaign, "--out", out, "--serial")
    assert (code, "pending" in said) == (3, False)


def test_a_dataset_in_which_a_case_is_pending_is_not_exit_code_0(main, campaign, monkeypatch):
    """Whatever has become of its result."""
    out, find = campaign.parent / "out", Store.find
    monkeypatch.setattr(
        Store, "find", lambda store, key: found if (found := find(store, key)) and found.kind != "drive" else None
    )
    for _ in range(2):
        code, _, errors = main("run", campaign, "--out", out, "--serial")
        assert (code, errors.count("8 outcomes pending")) == (99, 1)
    monkeypatch.setattr(Store, "find", find)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0


def test_a_full_disk_is_one_message_and_exit_code_2(main, campaign, monkeypatch):
    write = Store.write

    def full(store, result, shared):
        if result.kind == "record":
            raise StoreError("results: cannot write it: No space left on device")
        write(store, result, shared)

    monkeypatch.setattr(Store, "write", full)
    out = campaign.parent / "out"
    code, _, errors = main("run", campaign, "--out", out, "--serial")
    assert code == 2
    assert errors.count("No space left on device; what is finished is kept: run again to continue") == 1
    assert "Traceback" not in errors
    assert not (out / "results.nc").exists()
    assert not (out / "attempts.jsonl").exists()  # no fault of any task
    monkeypatch.setattr(Store, "write", write)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0


def test_a_rank_that_computes_loads_no_more_than_it_uses(environment):
    program = (
        "import sys; from pathlib import Path; from nanoslip.study.run.launch import computing; "
        "computing(Path('nowhere')).load(); "
        "print([name for name in ('xarray', 'pydantic', 'matplotlib', 'rich', 'pandas') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_run_with_nothing_to_do_does_not_collect_again_what_is_whole(main, campaign, monkeypatch):
    out = campaign.parent / "out"
    _, said, _ = main("run", campaign, "--out", out, "--serial")
    whole = (out / "results.nc").read_bytes()
    with monkeypatch.context() as once:
        once.setattr(datasets, "collect", None)  # would be called in vain
        code, again, _ = main("run", campaign, "--out", out, "--serial")
        assert (code, again) == (0, said)
    damaged = bytearray(whole)
    damaged[len(whole) // 2] ^= 1
    (out / "results.nc").write_bytes(damaged)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    assert (out / "results.nc").read_bytes() == whole
