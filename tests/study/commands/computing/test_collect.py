"""A dataset can be collected at any time."""

from pathlib import Path

import xarray as xr


def test_collecting_what_is_not_finished_says_pending(main, campaign):
    code, said, _ = main("collect", campaign, "--out", campaign.parent / "out")
    assert code == 0
    assert said.count("pending") == 8  # cases times drives
    with xr.open_dataset(campaign.parent / "out" / "results.nc") as found:
        assert set(found["outcome"].values.ravel()) == {"pending"}


def test_results_go_to_a_folder_named_after_the_campaign(main, campaign, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main("collect", campaign)
    assert Path("results/small/results.nc").is_file()


def test_a_failure_that_all_cases_share_is_said_once_in_red_with_its_advice(main, campaign, monkeypatch):
    campaign.write_text(campaign.read_text() + "[slip]\ncascade_limit = 1\n")
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("COLUMNS", "300")):
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NO_COLOR", raising=False)
    _, said, _ = main("collect", campaign, "--out", out)
    (line,) = (line for line in said.splitlines() if "raise it" in line)
    assert line.startswith("\x1b[31mcascade_limit: 4 of 4 cases, first μ_i = 0.25, R/L_x = 50: one event needed more")


def test_a_finished_dataset_is_not_replaced_by_one_of_a_changed_campaign_without_a_word(main, campaign, finished):
    out = finished
    before = (out / "results.nc").read_bytes()
    campaign.write_text(campaign.read_text().replace("n_x = 17", "n_x = 9"))
    code, _, said = main("collect", campaign, "--out", out)
    assert (code, (out / "results.nc").read_bytes()) == (2, before)
    assert "4 finished cases, collected now 0 of 4" in said
    assert f"nanoslip collect {campaign} --out {out} --replace writes" in said
    assert main("collect", campaign, "--out", out, "--replace")[0] == 0
    with xr.open_dataset(out / "results.nc") as found:
        assert set(found["outcome"].values.ravel()) == {"pending"}


def test_a_changed_campaign_of_which_all_is_there_is_collected(main, campaign, finished):
    """One value less of an axis leaves fewer cases, and loses none that are asked for."""
    out = finished
    campaign.write_text(campaign.read_text().replace("intrinsic_friction = [0.25, 0.5]", "intrinsic_friction = [0.5]"))
    assert main("collect", campaign, "--out", out)[0] == 0
