"""Members and length of records that nobody gave: parts of ± are a tenth of the error by the node spacing, at the lowest cost."""

import math
from dataclasses import replace
from typing import Any

import pytest

from nanoslip.solver.ensemble import FEWEST, student
from nanoslip.study import api
from nanoslip.study.accuracy.spending import LENGTHS, SHARE, Sample, probe_lengths, spending
from nanoslip.study.manifest.manifest import USUAL_MEMBERS, Manifest

SHORT, LONG = LENGTHS
FINE = Sample(33, SHORT, 0.44, 0.001, 0.0, 0.0)
COARSE = replace(FINE, n_x=17, mean=0.48)


def at(presliding: float, scatter: float, shared: float = 0.0) -> tuple[Sample, Sample]:
    return tuple(replace(each, presliding=presliding, scatter=scatter, shared=shared) for each in (FINE, COARSE))  # type: ignore[return-value]


ERROR = (COARSE.mean / FINE.mean - 1.0) / 2.0
"""Error by the spacing on 65 nodes, of first order: twice the spacing, 33 nodes, has twice it."""


def scatter_allowing(members: int) -> float:
    """The largest scatter with which so many members are enough on 65 nodes, but for rounding."""
    return 0.999 * SHARE * ERROR * math.sqrt(members) / float(student(members))


def test_the_change_by_half_the_spacing_is_of_first_order_in_it() -> None:
    """From 17 to 33 nodes by 9 %: then by half of that to 65 nodes, a quarter to 129."""
    samples, whole = [at(SHORT, 1e-6)], COARSE.mean / FINE.mean - 1.0
    for n_x, part in ((33, 2.0), (65, 4.0), (129, 8.0)):
        found = spending(samples, n_x)
        assert found is not None
        assert found.change == pytest.approx(whole / part, rel=1e-12)


def test_as_few_members_as_the_spacing_allows_and_no_more_than_usual() -> None:
    for members in range(FEWEST, USUAL_MEMBERS + 1):
        found = spending([at(SHORT, scatter_allowing(members))], 65)
        assert found is not None
        assert found.members == members
        assert found.error <= SHARE * ERROR
    scattered = spending([at(LONG, 10.0 * SHARE * ERROR)], 65)
    assert scattered is not None
    assert scattered.members == USUAL_MEMBERS
    assert scattered.share_of_usual == 1.0
    assert spending([], 65) is None


def test_what_members_share_asks_for_length_and_not_for_members() -> None:
    """More members reduce nothing that they share: a longer record does, up to the usual length."""
    little, too_much = 0.9 * SHARE * ERROR, 1.1 * SHARE * ERROR
    for shared, in_long, presliding in ((little, 0.0, SHORT), (too_much, 0.0, LONG), (too_much, too_much, LONG)):
        found = spending([at(SHORT, 1e-9, shared), at(LONG, 1e-9, in_long)], 65)
        assert found is not None
        assert (found.members, found.presliding) == (FEWEST, presliding)


def test_long_records_are_chosen_where_short_ones_need_more_time() -> None:
    """Three members of the long length take as long as six of the short one."""
    for short, long, chosen in ((3, 3, (3, SHORT)), (5, 3, (5, SHORT)), (8, 3, (3, LONG))):
        found = spending([at(SHORT, scatter_allowing(short)), at(LONG, scatter_allowing(long))], 65)
        assert found is not None
        assert (found.members, found.presliding) == chosen


@pytest.mark.slow
def test_a_probe_has_the_numbers_of_campaigns_of_its_own() -> None:
    content: dict[str, Any] = {
        "title": "x",
        "stages": ["contact", "slip"],
        "constants": {"radius": 50.0, "intrinsic_friction": 0.25},
        "ensemble": {"members": FEWEST},
    }

    def at_length(n_x: int, presliding: float) -> dict[str, Any]:
        return content | {"numerics": {"n_x": n_x}, "limits": {"presliding": presliding}}

    def manifest_of(n_x: int, presliding: float) -> Manifest:
        return api.read_campaign(at_length(n_x, presliding))

    for samples in probe_lengths(manifest_of, (17, 9)):
        for each in samples:
            run = api.run(at_length(each.n_x, each.presliding), progress=False)
            assert each.mean == run["plateau_mean"].item()
            stated = math.hypot(float(student(FEWEST)) * each.scatter / math.sqrt(FEWEST), each.shared) * each.mean
            assert stated == pytest.approx(run["plateau_mean_uncertainty"].item(), rel=1e-9)
