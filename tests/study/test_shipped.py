"""Data that comes with nanoslip is found in the source tree, and among the copies of an installed package before that."""

from pathlib import Path

import pytest

import nanoslip
from nanoslip.study import shipped
from tests.conftest import ROOT


def test_a_source_tree_has_its_own_folders():
    assert shipped.folder("campaigns") == ROOT / "campaigns"
    assert shipped.campaign_files()["smoke"] == ROOT / "campaigns" / "smoke.toml"


def test_copies_come_first_and_campaigns_in_folders_have_names_too(tmp_path, monkeypatch):
    figure = tmp_path / shipped.COPIES / "campaigns" / "figures" / "one.toml"
    figure.parent.mkdir(parents=True)
    figure.touch()
    monkeypatch.setattr(shipped, "_PACKAGE", tmp_path)
    assert shipped.campaign_files() == {"figures/one": figure}
    assert shipped.campaign_file(Path("figures/one")) == figure
    assert shipped.campaign_file(Path("figures/two")) == Path("figures/two")


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped.starters())
def test_a_starter_as_it_comes_completes_and_no_case_of_it_is_to_be_taken_with_care(name):
    found = nanoslip.run(shipped.starters()[name])
    assert set(found.outcome.values.ravel().tolist()) == {"completed"}
    assert not found.validity_flags.any()
    if "drive_outcome" in found:
        assert set(found.drive_outcome.values.ravel().tolist()) == {"completed"}
    if name == "events":
        assert (found.slips_exponent > 0.0).all()
