"""A dataset is computed again from itself alone; what cannot be is one clear message."""

import shutil

import netCDF4
import pytest

from nanoslip.study.run import executor


def test_a_dataset_is_verified_from_itself_alone(main, campaign, tmp_path, finished):
    out = finished
    path = tmp_path / "alone.nc"
    (out / "results.nc").rename(path)
    shutil.rmtree(out)
    campaign.unlink()
    code, said, progress = main("verify", path)
    assert (code, "13 of 13 tasks done" in progress) == (0, True)
    counts = f"{path}: cases: 4 bit-identical, 0 within tolerance, 0 different; what all cases share: bit-identical\n"
    assert said == counts

    with netCDF4.Dataset(path, "a") as opened:
        opened["mean_step"][1, 1, 0, 0] *= 1.0 + 1e-6
    code, said, _ = main("verify", path)
    assert code == 1
    (line,) = said.splitlines()[:-1]
    assert line.startswith("different: intrinsic_friction = 0.5, radius = 100")
    assert ": mean_step by " in line
    assert "3 bit-identical, 0 within tolerance, 1 different" in said
    path.rename(tmp_path / "results.nc")
    code, said, _ = main("verify", tmp_path, "--sample", 1)
    assert code == 0
    assert "1 bit-identical, 0 within tolerance, 0 different, 3 not in the sample" in said


def test_tasks_that_crash_disagree_with_nothing_there_or_here(main, campaign, monkeypatch):
    out, compute = campaign.parent / "out", executor.run_task

    def defective(task, inputs):
        if task.kind == "record" and task.case.radius > 60.0:
            raise ArithmeticError("a defect of the solver")
        return compute(task, inputs)

    monkeypatch.setattr(executor, "run_task", defective)
    assert main("run", campaign, "--out", out, "--serial")[0] == 3
    code, said, progress = main("verify", out)
    counts = "cases: 2 bit-identical, 0 within tolerance, 0 different, 2 failed, skipped; what all cases share: bit-identical"
    assert (code, counts in said) == (0, True)
    assert "2 of 4 cases to recompute" in progress

    monkeypatch.setattr(executor, "run_task", compute)
    assert main("run", campaign, "--out", out, "--serial", "--retry")[0] == 0
    monkeypatch.setattr(executor, "run_task", defective)
    code, said, errors = main("verify", out)
    assert (code, said) == (3, "")
    assert "6 tasks failed, or needed one that did: nothing is compared" in errors


@pytest.mark.parametrize("as_json", [False, True], ids=["words", "json"])
def test_a_dataset_without_any_result_cannot_be_computed_again(main, campaign, monkeypatch, as_json):
    out = campaign.parent / "out"

    def defective(task, inputs):
        raise ArithmeticError("a defect of the solver")

    monkeypatch.setattr(executor, "run_task", defective)
    assert main("run", campaign, "--out", out, "--serial")[0] == 3
    code, said, errors = main("verify", out, *["--json"][:as_json])
    assert (code, said) == (2, "")
    assert errors == f"Error: {out / 'results.nc'}: no case has a result to compute again: 4 failed\n"


def test_what_cannot_be_verified_is_one_clear_message(main, campaign):
    for path, said in ((campaign, "no dataset"), (campaign.parent / "none.nc", "No such file")):
        code, _, errors = main("verify", path)
        assert (code, len(errors.splitlines())) == (2, 1)
        assert str(path) in errors
        assert said in errors
    assert main("verify", campaign, "--sample", 0)[0] == 2
