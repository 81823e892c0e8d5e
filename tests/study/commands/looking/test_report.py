"""The command `report` needs a dataset."""


def test_a_report_without_a_dataset_says_what_makes_one(main, campaign):
    code, _, said = main("report", campaign, "--out", campaign.parent / "none")
    assert code == 2
    assert "run or collect the campaign first" in said
