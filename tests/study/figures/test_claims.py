"""Claims of docs/findings.md hold in a small form: of fewer starts or on smaller grids, within the same bounds."""

import pytest
from claims import Bounds, all_claims, number

from tests.study.figures.shipped_small import small

CHEAP = ()
"""Campaigns of which a small form takes a second or less."""


@pytest.mark.parametrize(
    "claim",
    [
        pytest.param(each, marks=() if each.campaign in CHEAP else pytest.mark.slow, id=each.claim)
        for each in all_claims()
    ],
)
def test_a_claim_holds(claim: Bounds) -> None:
    found = number(claim, small(claim.campaign))
    assert claim.low <= found.value <= claim.high, found
