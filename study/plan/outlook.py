"""Forecast for a plan's cases before anything is computed: validity flags, and lengths of records."""

import math
from typing import NamedTuple

from nanoslip.solver.sliding.validity import expected_flags, mask_of
from nanoslip.study.plan.cost.counts import expected_displacement
from nanoslip.study.plan.plan import Plan


class Outlook(NamedTuple):
    """Expected flags of the cases, and lengths of their records."""

    masks: bytes
    """Flags of every case, as bits; none of a refused one."""
    shortest: float
    """Record in node spacings; infinite where nothing slides."""
    longest: float


def outlook_of(plan: Plan) -> Outlook:
    """In one pass, as a plan may have millions of cases."""
    slides = "slip" in plan.manifest.stages
    masks, shortest, longest = bytearray(), math.inf, 0.0
    for case in (each.case for each in plan.cases):
        displacement = 0.0
        if case is not None and slides:
            displacement = expected_displacement(case)
            span = displacement / case.slab.spacing
            shortest, longest = min(shortest, span), max(longest, span)
        masks.append(mask_of(expected_flags(case, displacement)) if case is not None else 0)
    return Outlook(bytes(masks), shortest, longest)
