"""The state of a campaign is counted from its files alone: tasks, and cases and drives by outcome."""

import json
import threading
import time

import pytest

from nanoslip.study.commands import prepare as status
from nanoslip.study.results.store import Store
from tests.conftest import PARTLY_REFUSED


def test_outcomes_are_counted_as_the_dataset_has_them(main, campaign):
    out = campaign.parent / "out"
    campaign.write_text(PARTLY_REFUSED)
    code, said, _ = main("status", campaign, "--out", out, "--json")
    assert code == 0
    assert json.loads(said)["cases"] == {"pending": 12, "invalid": 4}
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    _, said, _ = main("status", campaign, "--out", out, "--json")
    found = json.loads(said)
    assert (found["finished"], sum(found["cases"].values()), sum(found["drives"].values())) == (True, 16, 32)
    import xarray as xr

    with xr.open_dataset(out / "results.nc") as data:
        for key, name in (("cases", "outcome"), ("drives", "drive_outcome")):
            words = data[name].values.ravel().tolist()
            assert found[key] == {word: words.count(word) for word in set(words)}
    _, said, _ = main("status", campaign, "--out", out)
    rows = {line.split()[0]: line.split()[1:] for line in said.splitlines() if line.strip()}
    assert rows["invalid"] == ["4", "8"]


def test_a_campaign_is_watched_until_it_is_finished_a_line_for_each_change(main, campaign, finished, monkeypatch):
    """Without a terminal; results come in while somebody looks."""
    monkeypatch.setattr(status, "INTERVAL", 0.01)
    out = campaign.parent / "out"
    known, arriving = Store(finished), Store(out)
    arriving.prepare()

    def arrive() -> None:
        for key in sorted(known.finished()):
            arriving.write(known.read(key))
            time.sleep(0.02)

    other = threading.Thread(target=arrive)
    other.start()
    code, said, _ = main("status", campaign, "--out", out, "--watch")
    other.join()
    lines = said.splitlines()
    assert code == 0
    assert lines[-1] == "13 of 13 tasks; cases: 4 completed; drives: 6 completed, 1 no_plateau, 1 no_slip"
    done = [int(line.split()[0]) for line in lines]
    assert done == sorted(done)
    assert len(set(lines)) == len(lines) > 2


def test_ctrl_c_ends_watching_without_a_word(main, campaign, monkeypatch):
    def interrupted(_: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(status.time, "sleep", interrupted)
    code, said, errors = main("status", campaign, "--out", campaign.parent / "out", "--watch")
    assert (code, len(said.splitlines()), errors) == (0, 1, "")


def test_a_terminal_is_redrawn(main, campaign, finished, monkeypatch):
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("COLUMNS", "80")):
        monkeypatch.setenv(name, value)
    code, said, _ = main("status", campaign, "--out", finished, "--watch")
    assert code == 0
    assert "A small campaign" in said
    assert "no_slip" in said


@pytest.mark.parametrize("options", [("--watch", "--json")])
def test_a_document_is_not_watched(main, campaign, options):
    assert main("status", campaign, *options)[0] == 2
