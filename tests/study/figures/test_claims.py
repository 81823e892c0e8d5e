"""Claims of docs/findings.md hold in a small form: of fewer starts or on smaller grids, within the same bounds."""

import re
from typing import Any

import pytest
from claims import Bounds, all_claims, content_of, number

from nanoslip.study.figures.shared import Number
from tests.conftest import ROOT
from tests.study.figures.shipped_small import small

CHEAP = ("paths/reversal",)
"""Campaigns of which a small form takes a second or less."""

FORMS = {"figures/resolution": "axes.n_x = [33, 65, 257]\nensemble.members = 2"}
"""Campaigns that claims need in a larger form than figures do."""


@pytest.mark.parametrize(
    "claim",
    [
        pytest.param(each, marks=() if each.campaign in CHEAP else pytest.mark.slow, id=each.claim)
        for each in all_claims()
    ],
)
def test_a_claim_holds(claim: Bounds) -> None:
    """Within its ±, which is wider than that of the whole campaign."""
    found = number(claim, small(claim.campaign, FORMS.get(claim.campaign, "")))
    assert found.value + found.error >= claim.low
    assert found.value - found.error <= claim.high


ERROR = re.compile(r"-?[0-9]+\.[0-9]+ ± [0-9]+\.[0-9]+")


def test_every_number_of_the_page_is_in_a_table() -> None:
    tables = (ROOT / "campaigns" / "findings" / "claims.md").read_text("utf-8")
    stated = ERROR.findall((ROOT / "docs" / "findings.md").read_text("utf-8"))
    assert len(stated) > 20
    assert set(stated) <= set(ERROR.findall(tables))


def test_the_table_has_every_claim_and_each_holds() -> None:
    """As it is committed: a row that breaks its bounds would end `make findings` with 1."""
    rows = [
        line.split(" | ") for line in (ROOT / "campaigns" / "findings" / "claims.md").read_text("utf-8").splitlines()
    ]
    shown = [row for row in rows if len(row) == 5][2:]
    assert [row[0].removeprefix("| ") for row in shown] == [f"{each.finding}: {each.claim}" for each in all_claims()]
    assert [row[3] for row in shown] == [each.over for each in all_claims()]
    for claim, row in zip(all_claims(), shown, strict=True):
        value, _, error = row[2].partition(" ± ")
        assert bool(error) != claim.over.startswith("none") or not float(value), row
        assert claim.hold(Number(float(value), float(error or 0.0))), row


def radius_of(content: dict[str, Any]) -> float:
    """The first radius of a campaign."""
    drawn = content.get("axes", {}).get("radius") or content.get("constants", {}).get("radius", 200.0)
    return float(drawn[0] if isinstance(drawn, list) else drawn)


@pytest.mark.parametrize("campaign", dict.fromkeys(claim.campaign for claim in all_claims()))
def test_other_starts_are_of_the_same_campaign(campaign: str) -> None:
    """Axes of starts move; members are drawn anew, by a radius that is the same but for rounding."""
    first, again = (content_of(campaign, number) for number in (0, 1))
    starts, others = (content.get("axes", {}).get("start") for content in (first, again))
    assert starts is None or set(starts).isdisjoint(others)
    assert again["heterogeneity"]["seed"] == 2
    radius = radius_of(again) / radius_of(first)
    assert 1.0 < radius < 1.0 + 1e-6
