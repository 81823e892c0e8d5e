"""Hard slabs: any Poisson's ratio, thin films to pillars, five nodes to thousands, few rows to all, nanometres to metres.

An operator that is not positive definite is no elastic body: what ends badly on it must say so and name the scheme galerkin.
"""

import itertools
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import ILL_CONDITIONED, SurfaceCompliance, conditioning
from nanoslip.solver.elasticity.schemes import Biquadratic
from nanoslip.solver.outcome import Ending, InvalidInput, SingularOperator
from nanoslip.solver.slab import Slab, Support
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.hard_cases.following import Followed, compliance_of, follow
from tests.physics import ROWS, assert_contact_laws, half_plane

POISSON = (0.0, 0.3, 0.49, 0.4999, -0.9)
ASPECTS = (0.01, 0.1, 1.0, 10.0, 100.0)
SUPPORTS: tuple[Support, ...] = get_args(Support)
PILLARS = (11.0, 100.0, 1e3, 1e4)
"""Heights that have no grid of their own; a load moves the highest by 1e12 times as much sideways as it dents it."""
NAMED = {Ending.COMPLETED, Ending.SLIP_UNBOUNDED, Ending.CASCADE_LIMIT, Ending.CONTACT_NOT_CONVERGED}
NAMED |= {Ending.SINGULAR_OPERATOR, Ending.INVALID, Ending.OVERSHOT, Ending.ENERGY_CREATED}
RULE = SlipRule(cascade_limit=100_000)


def _case(slab: Slab) -> Case:
    # A pillar moves by 1e7 loads: a load that leaves it about its own width.
    normal_load, radius = (1e-9, 2e8) if slab.aspect_ratio > 50.0 else (1e-3, 200.0)
    return Case(slab=slab, normal_load=normal_load, radius=radius, slip_rule=RULE, max_events=1)


def _slabs(scheme: str, sizes: tuple[int, ...]) -> list[Slab]:
    slabs = []
    for poisson in POISSON:
        for aspect in ASPECTS:
            for n_x in sizes:
                for rows in {3, None} if n_x > 5 else {None}:
                    try:
                        given = {"n_x": n_x, "aspect_ratio": aspect, "poisson": poisson, "scheme": scheme, "rows": rows}
                        slabs.append(Slab.of(given))
                    except InvalidInput:  # not every scheme takes every number of rows
                        continue
    return slabs


def _pillars(support: Support, sizes: tuple[int, ...]) -> list[Slab]:
    return [Slab(n_x, height, poisson, support) for height in PILLARS for poisson in POISSON for n_x in sizes]


def _tried(slab: Slab, whole: int = 100) -> Followed:
    seen = Followed()
    try:
        return follow(_case(slab), compliance_of(slab), 6, whole)
    except (SingularOperator, InvalidInput) as error:
        seen.endings[error.outcome.ending] += 1
        seen.messages.add(str(error))
    return seen


def _sound(slab: Slab) -> bool:
    """True if the operator is an elastic body's, and has digits enough for the laws."""
    try:
        found = conditioning(compliance_of(slab).matrix)
    except SingularOperator:  # rounding is all that is left where cells are so high and narrow
        return slab.aspect_ratio < 100.0
    return found.positive_definite and found.reciprocal_condition > 0.1 * ILL_CONDITIONED


@pytest.mark.everyday(8)
@pytest.mark.parametrize("poisson", POISSON)
@pytest.mark.parametrize("scheme", ROWS)
def test_every_slab_obeys_the_laws_or_says_why_not(scheme: str, poisson: float) -> None:
    for slab in _slabs(scheme, (5, 17)):
        if slab.poisson != poisson:
            continue
        seen = _tried(slab)
        assert not seen.broken, slab
        assert set(seen.endings) <= NAMED, slab
        if not set(seen.endings) <= {Ending.COMPLETED, Ending.INVALID}:
            # Only an operator that is no elastic body's may fail, and the user is told what to do.
            advice = " ".join(seen.messages)
            assert "scheme galerkin" in advice or "poisson further" in advice, (slab, advice)
            assert not _sound(slab), slab


@pytest.mark.parametrize(
    "support",
    [support if support == "right_side" else pytest.param(support, marks=pytest.mark.slow) for support in SUPPORTS],
)
def test_pillars_obey_the_laws_or_are_told_to_be_lower(support: Support) -> None:
    """Up to 100 widths only ν = 0.4999 is ill-conditioned; a held right side keeps a pillar of any height from swaying."""
    for slab in _pillars(support, (17, 33)):
        seen = _tried(slab)
        assert not seen.broken, slab
        assert set(seen.endings) <= NAMED, slab
        if set(seen.endings) != {Ending.COMPLETED}:
            assert support != "right_side", slab
            assert slab.aspect_ratio > 100.0 or slab.poisson == 0.4999, slab
            assert "aspect_ratio nearer 1" in " ".join(seen.messages), (slab, seen.messages)


@pytest.mark.slow
@pytest.mark.parametrize(("n_x", "scheme"), [*itertools.product((257, 1025), ROWS), (2049, "galerkin")])
def test_many_nodes_obey_the_laws(n_x: int, scheme: str) -> None:
    seen = _tried(Slab(n_x, scheme=scheme), whole=20)
    assert not seen.broken
    assert set(seen.endings) == {Ending.COMPLETED}


@pytest.mark.parametrize("rows", [3, 4, 5, 6])
def test_every_number_of_the_stencils_rows_obeys_the_laws(rows: int) -> None:
    seen = _tried(Slab(33, scheme=Biquadratic(rows=rows)))
    assert not seen.broken
    assert set(seen.endings) == {Ending.COMPLETED}


def test_a_contact_that_leaps_across_a_soft_slab_finds_its_deepest_node() -> None:
    """At its end the pin leaves one side of a pillar and lands on the other, far beyond the nodes followed until then."""
    slab = Slab(33, aspect_ratio=10.0, poisson=-0.5, scheme="biquadratic")
    # It leaps after about 300 events; after which of them is up to rounding: the stiffness leaves ten digits of the compliance.
    case = Case(slab=slab, max_events=330)
    record, end = slide_to_state(case, compliance_of(slab))
    assert record.outcome.ok
    assert_contact_laws(end, case, compliance_of(slab))
    assert record.final_displacement > 0.5
    assert end.contact.any()
    assert not end.contact[:16].any()


def test_an_operator_that_does_negative_work_is_detected_and_named() -> None:
    """One eigenvalue of a reciprocal operator turned negative: contact cannot be right, and the outcome says why."""
    slab = Slab(33)
    sound = half_plane(slab)
    assert conditioning(sound.matrix).positive_definite
    values, vectors = np.linalg.eigh(sound.matrix)
    values[:8] = -values[-1]
    broken = SurfaceCompliance((vectors * values) @ vectors.T, slab)
    assert not conditioning(broken.matrix).positive_definite
    state = initial_contact(_case(slab), broken)
    record = slide(replace(_case(slab), max_events=50), broken)
    outcome = record.outcome if state.outcome.ok else state.outcome
    assert not outcome.ok
    assert "not positive definite" in outcome.message
    assert "galerkin" in outcome.message
