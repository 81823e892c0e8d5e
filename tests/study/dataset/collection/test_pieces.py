"""A campaign in pieces is the plan of the whole, and so is its dataset; a piece more takes no more memory."""

import tracemalloc
from pathlib import Path

import pytest

from nanoslip.study.dataset import collect as pieces_module
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import InPieces, collect, pieces
from nanoslip.study.manifest.cases import CampaignCase, cases_of, expand
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.plan import CaseTasks, make_plan
from nanoslip.study.results.store import Store
from tests.conftest import PARTLY_REFUSED, SMALL
from tests.study.dataset.campaigns import Build

ZIPPED = 'design = "zip"\n' + SMALL
TABLED = 'table = "cases.csv"\n' + SMALL[: SMALL.index("[axes]")] + SMALL[SMALL.index("[numerics]") :]
OVER_SUPPORTS = SMALL.replace("[axes]", '[axes]\nsupport = ["bonded", "frictionless"]')
DRAWN = SMALL.replace("members = 1", "members = 3") + "[heterogeneity]\nspread = 0.1\n"
UNTIL_KNOWN = SMALL.replace("ensemble.members = 1", "target.within = 0.1")
CAMPAIGNS = {
    "product": SMALL,
    "further axis": OVER_SUPPORTS,
    "zip": ZIPPED,
    "partly refused": PARTLY_REFUSED,
    "members": DRAWN,
    "members until known": UNTIL_KNOWN,
}


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces_module, "CASES", 3)


def manifest(text: str) -> Manifest:
    return parse_manifest(Path("mine.toml"), text, {})


@pytest.mark.parametrize("text", CAMPAIGNS.values(), ids=CAMPAIGNS)
def test_all_pieces_have_the_cases_and_keys_of_the_plan_in_its_order(text: str) -> None:
    whole, campaign = make_plan(manifest(text)), InPieces(manifest(text))
    found: list[tuple[CampaignCase, CaseTasks]] = []
    for numbers in pieces(campaign):
        piece = campaign.piece(numbers)
        assert (piece.count, piece.tasks) == (len(numbers), ())
        found += piece.case_tasks.in_order()
    assert found == list(whole.case_tasks.in_order())
    assert campaign.count == len(whole.cases)


@pytest.mark.parametrize("text", CAMPAIGNS.values(), ids=CAMPAIGNS)
def test_a_piece_of_a_plan_is_that_of_its_campaign(text: str) -> None:
    whole, campaign = make_plan(manifest(text)), InPieces(manifest(text))
    for numbers in pieces(whole):
        assert list(whole.piece(numbers).case_tasks.in_order()) == list(campaign.piece(numbers).case_tasks.in_order())


@pytest.mark.parametrize("text", CAMPAIGNS.values(), ids=CAMPAIGNS)
def test_cases_of_some_numbers_are_those_of_the_whole_campaign(text: str) -> None:
    campaign = manifest(text)
    cases, count = expand(campaign), campaign.case_count
    for numbers in (range(count), range(1, 2), range(2, count), range(count, count)):
        assert tuple(cases_of(campaign, numbers)) == cases[numbers.start : numbers.stop]


@pytest.mark.parametrize("text", [SMALL, ZIPPED, TABLED, PARTLY_REFUSED, DRAWN])
def test_a_dataset_collected_in_pieces_has_the_bytes_of_that_of_the_plan(
    build: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    plan, store = build(text)
    found = []
    for size, source in ((3, InPieces(load_manifest(plan.manifest.path))), (3, plan), (4096, plan)):
        monkeypatch.setattr(pieces_module, "CASES", size)
        file.write(collect(source, store), tmp_path / file.FILE)
        found.append((tmp_path / file.FILE).read_bytes())
    assert found[0] == found[1] == found[2]


def test_two_cases_that_are_the_same_are_named(tmp_path: Path) -> None:
    text = SMALL.replace("radius = [50.0, 100.0]", 'pin = ["flat_punch"]\nhalf_width = [0.1, 0.2, 0.1]')
    with pytest.raises(ManifestError) as wanted:
        make_plan(manifest(text))
    with pytest.raises(ManifestError) as raised:
        collect(InPieces(manifest(text)), Store(tmp_path))
    assert str(raised.value) == str(wanted.value)


def test_a_piece_more_takes_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes that are held while a campaign is gone through: 460 for each case when all of them were kept, now 11 seen."""
    monkeypatch.setattr(pieces_module, "CASES", 100)
    taken = {}
    for count in (2000, 200, 2000):  # what the first one makes is kept for all: texts of numbers, for one
        axis = ", ".join(map(str, range(50, 50 + count)))
        campaign = InPieces(
            manifest(f'title = "x"\nlimits.events = 5\noutputs.records = false\naxes.radius = [{axis}]\n')
        )
        tracemalloc.start()
        try:
            for numbers in pieces(campaign):
                campaign.piece(numbers)
            taken[count] = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert (taken[2000] - taken[200]) / 1800 < 50
