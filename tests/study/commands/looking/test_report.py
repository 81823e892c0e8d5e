"""The command `report` needs a dataset, whole."""

from study.dataset.file import FILE
from study.report import page


def test_a_report_without_a_dataset_says_what_makes_one(main, campaign):
    code, _, said = main("report", campaign, "--out", campaign.parent / "none")
    assert code == 2
    assert "run or collect the campaign first" in said


def test_a_report_of_a_dataset_that_was_damaged_says_so(main, campaign, monkeypatch):
    """As netCDF says of a column that it cannot unpack, when the page asks for it."""
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0

    def damaged(*_: object) -> None:
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(page, "write", damaged)
    code, _, said = main("report", campaign, "--out", out)
    assert code == 2
    assert f"{out / FILE}: cannot be read: NetCDF: HDF error" in said
