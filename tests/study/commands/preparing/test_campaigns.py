"""Campaigns that come with nanoslip are listed, and run by name."""

from nanoslip.study.shipped import campaigns


def test_the_campaigns_are_listed_by_name_and_title(main):
    code, said, _ = main("campaigns")
    assert code == 0
    lines = said.splitlines()
    assert [line.split()[0] for line in lines[:-1]] == list(campaigns())
    assert any(line.split(maxsplit=1) == ["smoke", "Smoke: the paper's case through every stage"] for line in lines)


def test_a_campaign_is_planned_by_name(main, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, said, _ = main("plan", "smoke")
    assert (code, "2 cases" in said) == (0, True)


def test_a_file_comes_before_a_campaign_of_that_name(main, campaign, monkeypatch):
    monkeypatch.chdir(campaign.parent)
    campaign.rename("smoke")
    assert "A small campaign" in main("plan", "smoke")[1]
