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
