"""The command line: each wrong input is one clear message and exit code 2; the physics' refusals are results."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import netCDF4
import pytest
import xarray as xr

from study.commands import cli
from study.dataset.store import Store
from study.origin import here
from tests.conftest import ROOT, SMALL

Main = Callable[..., tuple[int, str, str]]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS")


@pytest.fixture
def main(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Main:
    """Call the command line in this process; returns exit code, standard output and standard error."""
    for name in THREADS:  # a run sets them; this puts them back
        monkeypatch.setenv(name, "1")

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["nanoslip", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return call


WRONG = {
    "an unknown key": ("n_x = 17", "n_y = 17", "numerics.n_y = 17", "did you mean n_x"),
    "a wrong type": ("events = 60", 'events = "many"', 'limits.events = "many"', "whole number"),
    "n_x that is not 2^N+1": ("n_x = 17", "n_x = 16", "numerics.n_x = 16", "2^N + 1"),
    "a Poisson's ratio of 0.5": (
        "[numerics]",
        "[constants]\npoisson = 0.5\n[numerics]",
        "poisson = 0.5",
        "poisson < 0.5",
    ),
    "a negative radius": ("radius = [50.0, 100.0]", "radius = [-50.0]", "axes.radius[0] = -50.0", "1e-12 ≤ radius"),
    "an empty axis": ("radius = [50.0, 100.0]", "radius = []", "axes.radius = []", "at least one value"),
    "a case twice": ("radius = [50.0, 100.0]", "radius = [50.0, 50]", "cases 1 and 2 are the same", "radius = 50.0"),
    "no TOML": ("[axes]", "[axes", "small.toml", ""),
}


@pytest.mark.parametrize("command", ["plan", "run", "status", "collect"])
@pytest.mark.parametrize(("line", "wrong", "where", "need"), WRONG.values(), ids=WRONG)
def test_a_wrong_campaign_is_one_clear_message(main, campaign, command, line, wrong, where, need):
    assert line in SMALL
    campaign.write_text(SMALL.replace(line, wrong))
    out = () if command == "plan" else ("--out", campaign.parent / "out")
    code, _, said = main(command, campaign, *out, *(("--serial",) if command == "run" else ()))
    assert code == 2
    assert said.startswith(f"Error: {campaign}")
    assert where in said
    assert need in said
    assert "Traceback" not in said
    assert not (campaign.parent / "out").exists()


@pytest.mark.parametrize("command", ["plan", "run", "status", "collect"])
def test_a_missing_campaign_is_one_clear_message(main, tmp_path, command):
    code, _, said = main(command, tmp_path / "none.toml", *(("--serial",) if command == "run" else ()))
    assert (code, said) == (2, f"Error: {tmp_path / 'none.toml'}: cannot be read: No such file or directory\n")


@pytest.mark.parametrize("command", ["run", "collect"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(main, campaign, command):
    # A path through a file: not even root can write there.
    code, _, said = main(command, campaign, "--out", campaign / "out", *(("--serial",) if command == "run" else ()))
    assert code == 2
    assert said.startswith(f"Error: {campaign / 'out'}")
    assert len(said.splitlines()) == 1


def test_a_report_without_a_dataset_says_what_makes_one(main, campaign):
    code, _, said = main("report", campaign, "--out", campaign.parent / "none")
    assert code == 2
    assert "run or collect the campaign first" in said


@pytest.mark.parametrize("arguments", [("plam",), ("plan",), ("run", "x.toml", "--fast"), ()])
def test_a_wrong_command_line_is_exit_code_2(main, arguments):
    code, _, said = main(*arguments)
    assert code == 2
    assert "Usage" in said


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


def disown(out: Path, every: int) -> set[str]:
    """Make every so-manieth result another software's; returns the files."""
    store, changed = Store(out), set()
    for key in sorted(store.finished())[::every]:
        result = store.read(key)
        store.write(replace(result, origins=(replace(here(), source_hash="0ther", source_commit="c0ffee"),)))
        changed.add(key)
    return changed


def test_results_of_other_software_are_named_and_computed_again_when_asked(main, campaign):
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    for command in ("plan", "status"):
        assert "other software's" not in main(command, campaign, "--out", out)[1]
    before = (out / "results.nc").read_bytes()
    changed = disown(out, every=3)
    stamps = {path.stem: path.stat().st_mtime_ns for path in (out / "results").glob("*.npz")}
    for command in ("plan", "status"):
        code, said, _ = main(command, campaign, "--out", out)
        assert code == 0
        assert f"{len(changed)} finished results are other software's: {len(changed)} of nanoslip" in said
        assert "source 0ther, commit c0ffee" in said
        assert f"nanoslip run {campaign} --recompute-foreign" in said

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
    after = {path.stem: path.stat().st_mtime_ns for path in (out / "results").glob("*.npz")}
    assert {key for key in after if after[key] != stamps[key]} == changed & set(after)


def test_a_dataset_is_verified_from_itself_alone(main, campaign, tmp_path):
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    path = tmp_path / "alone.nc"
    (out / "results.nc").rename(path)
    shutil.rmtree(out)
    campaign.unlink()
    code, said, progress = main("verify", path)
    assert (code, "13 of 13 tasks done" in progress) == (0, True)
    assert said.count("bit-identical") == 1 + 4 + 2  # all share; cases; the last line
    assert f"{path}: cases: 4 bit-identical, 0 within tolerance, 0 different; what all cases share: bit-id" in said

    with netCDF4.Dataset(path, "a") as opened:
        opened["mean_step"][1, 1, 0, 0] *= 1.0 + 1e-6
    code, said, _ = main("verify", path)
    assert (code, "mean_step by " in said) == (1, True)
    assert "3 bit-identical, 0 within tolerance, 1 different" in said
    code, said, _ = main("verify", path, "--sample", 1)
    assert code == 0
    assert "1 bit-identical, 0 within tolerance, 0 different, 3 not in the sample" in said


def test_what_cannot_be_verified_is_one_clear_message(main, campaign):
    for path, said in ((campaign, "no dataset"), (campaign.parent / "none.nc", "No such file")):
        code, _, errors = main("verify", path)
        assert (code, len(errors.splitlines())) == (2, 1)
        assert str(path) in errors
        assert said in errors
    assert main("verify", campaign, "--sample", 0)[0] == 2


def test_a_plan_shows_effects_tasks_and_memory(main, campaign):
    campaign.write_text(SMALL + "[effects]\ncoupling = false\n[outputs]\nrecords = false\ntractions_at = [5]\n")
    code, said, _ = main("plan", campaign)
    assert code == 0
    rows = {
        cells[0]: cells
        for line in said.splitlines()
        if (cells := [cell.strip() for cell in line.split("   ") if cell.strip()])
    }
    assert rows["coupling"][1:] == ["off", rows["coupling"][2]]
    assert rows["coupling"][2].startswith("shear and pressure do not act on each other")
    assert rows["pin_translation"][1:] == ["on"]
    assert rows["outputs.records"][2] == "friction records are not kept once their drives are done"
    assert rows["tasks"][-1] == "MB of arrays each, about"
    assert [rows[kind][1] for kind in ("compliance", "record", "states", "drive")] == ["1", "8", "4", "8"]


def test_records_that_nobody_wants_are_gone_after_the_run(main, campaign):
    out = campaign.parent / "out"
    campaign.write_text(SMALL + "[outputs]\nrecords = false\ntrajectory = false\n")
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    sizes = [path.stat().st_size for path in (out / "results").glob("*.npz")]
    assert len(sizes) == 4 + 8  # scalars of records and of drives
    assert max(sizes) < 5_000
    code, said, progress = main("run", campaign, "--out", out, "--serial")
    assert (code, "0 tasks to do" in progress) == (0, True)
    # One slow stage never gets the pin to slip, another so late that its mean force says nothing yet.
    assert [said.count(ending) for ending in ("completed", "no_slip", "no_plateau")] == [6, 1, 1]


def test_collecting_what_is_not_finished_says_pending(main, campaign):
    code, said, _ = main("collect", campaign, "--out", campaign.parent / "out")
    assert code == 0
    assert said.count("pending") == 8  # cases times drives
    with xr.open_dataset(campaign.parent / "out" / "results.nc") as found:
        assert set(found["outcome"].values.ravel()) == {"pending"}


def test_cases_that_physics_refuses_are_results_and_exit_code_0(main, campaign):
    text = SMALL.replace("n_x = 17", 'scheme = "biquadratic"').replace("[axes]", "[axes]\nrows = [4, 5]\nn_x = [9, 17]")
    campaign.write_text(text)
    code, said, _ = main("plan", campaign)
    assert (code, "16 cases, 4 of them refused" in said) == (0, True)
    code, said, _ = main("run", campaign, "--out", campaign.parent / "out", "--serial")
    assert code == 0
    assert "invalid: rows = 5: needs 3 to 4 rows at n_x = 9" in said


def test_a_defect_is_exit_code_1_and_keeps_the_rest(main, campaign, monkeypatch):
    from study.plan import tasks

    compute = tasks.run_task

    def defective(task, inputs):
        if task.kind == "record" and task.case.radius == 100.0:
            raise RuntimeError("a defect")
        return compute(task, inputs)

    monkeypatch.setattr(tasks, "run_task", defective)
    out = campaign.parent / "out"
    code, said, errors = main("run", campaign, "--out", out, "--serial")
    assert code == 1
    assert "6 tasks crashed" in errors  # two records and the two drives of each
    assert "RuntimeError: a defect" in errors
    assert [said.count(word) for word in ("completed", "no_slip", "pending")] == [3, 1, 4]
    monkeypatch.setattr(tasks, "run_task", compute)
    assert main("run", campaign, "--out", out, "--serial")[0] == 0


def test_submit_writes_the_script_and_its_folder(main, campaign):
    out = campaign.parent / "out"
    code, said, _ = main("submit", campaign, "--out", out, "--site", ROOT / "slurm" / "site.toml")
    assert (code, said) == (0, f"{out / 'job.sh'}: sbatch it, or use --submit\n")
    assert f"nanoslip run {campaign} --out {out}" in (out / "job.sh").read_text()
    code, _, said = main("submit", campaign, "--out", out, "--site", campaign.parent / "none.toml")
    assert (code, len(said.splitlines())) == (2, 1)


def test_help_is_instant_and_loads_nothing_heavy(environment):
    program = (
        "import sys; from study.commands.cli import cli; "
        "cli.main(['--help'], standalone_mode=False); "
        "print([name for name in ('numpy', 'xarray', 'numba', 'mpi4py', 'matplotlib', 'rich') if name in sys.modules])"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - start
    assert done.stdout.splitlines()[-1] == "[]"
    assert seconds < 2.0  # 0.15 s here; a machine under load is given ten times as much


def test_a_rank_that_computes_loads_no_more_than_it_uses(environment):
    program = (
        "import sys; from pathlib import Path; from study.commands.cli import _executor; _executor(Path('nowhere')); "
        "print([name for name in ('xarray', 'pydantic', 'matplotlib', 'rich', 'pandas') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_module_is_the_command(nanoslip):
    done = nanoslip("--help")
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: nanoslip")
    for command in ("plan", "run", "status", "collect", "report", "verify", "submit"):
        assert command in done.stdout


def test_results_go_to_a_folder_named_after_the_campaign(main, campaign, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main("collect", campaign)
    assert Path("results/small/results.nc").is_file()
