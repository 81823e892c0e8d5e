"""The command `report` needs a dataset, whole, and says where its page is."""

from nanoslip.study.dataset.file import FILE
from nanoslip.study.report import page


def test_a_report_without_a_dataset_says_what_makes_one(main, campaign):
    code, _, said = main("report", campaign, "--out", campaign.parent / "none")
    assert code == 2
    assert "run or collect the campaign first" in said


def test_a_report_repeats_no_table_that_its_run_has_printed(main, campaign):
    """One after the other, as `make run` calls them, they print it once."""
    out = campaign.parent / "out"
    code, ran, _ = main("run", campaign, "--out", out, "--serial")
    assert (code, "plateau" in ran) == (0, True)
    assert main("report", campaign, "--out", out)[:2] == (0, f"report: {out / page.FILE}\n")
    assert (out / page.FILE).is_file()


def test_a_report_of_a_dataset_that_was_damaged_says_so(main, campaign, monkeypatch, finished):
    """As netCDF says of a column that it cannot unpack, when the page asks for it."""
    out = finished

    def damaged(*_: object) -> None:
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(page, "write", damaged)
    code, _, said = main("report", campaign, "--out", out)
    assert code == 2
    assert f"{out / FILE}: cannot be read: NetCDF: HDF error" in said


def test_a_report_of_a_campaign_that_has_changed_since_is_refused(main, campaign, finished):
    """Else it would show the numbers of another campaign below the title of this one."""
    out = finished
    campaign.write_text(campaign.read_text().replace("n_x = 17", "n_x = 9"))
    code, _, said = main("report", campaign, "--out", out)
    assert (code, (out / page.FILE).exists()) == (2, False)
    assert f"no dataset of {campaign} as it is now" in said
