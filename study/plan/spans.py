"""How much of what repeats a plan's records will see, and what it would cost to see all of it."""

import math

from study.plan.cost.seconds import spacing_seconds
from study.plan.cost.sliding import expected_displacement
from study.plan.plan import Plan


def span_line(plan: Plan) -> str:
    """The node spacings that the records will span, and the price of one for each; empty where nothing slides."""
    if "slip" not in plan.manifest.stages:
        return ""
    shortest, longest, price = math.inf, 0.0, 0.0
    for case in (each.case for each in plan.cases if each.case is not None):
        span = expected_displacement(case) / case.slab.spacing
        shortest, longest = min(shortest, span), max(longest, span)
        price += spacing_seconds(case)
    if shortest > longest:  # no case
        return ""
    low, high = f"{shortest:.2g}", f"{longest:.2g}"
    return (
        f"node spacings that records span, to a factor of two: {low if low == high else f'{low} to {high}'}; what the pin meets "
        f"repeats with them. One for each record: {float(f'{price:.2g}'):g} core seconds"
    )
